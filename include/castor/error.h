#pragma once

#include <cstddef>
#include <stdexcept>
#include <string>

#include "castor/api.h"

namespace castor {

/// Base of everything that Castor throws on purpose. what() is a complete sentence for a person.
class CASTOR_API Error : public std::runtime_error {
public:
    using std::runtime_error::runtime_error;
};

/// The input is wrong: a scene, mesh or ray file, or a Scene made by a program.
class CASTOR_API SceneError : public Error {
public:
    /// `file` may be empty (a scene that a program made); `line` 0 means that no line is known.
    /// what() is "file:line: reason".
    SceneError(std::string file, std::size_t line, std::string reason);

    const std::string& file() const { return file_; }
    std::size_t line() const { return line_; }
    const std::string& reason() const { return reason_; }

private:
    std::string file_;
    std::size_t line_;
    std::string reason_;
};

/// A device, or its driver, refuses: a call failed, a kernel does not compile, no device was found.
class CASTOR_API DeviceError : public Error {
public:
    /// `device` may be empty (no device yet); `code` is the OpenCL status, 0 where there is none.
    /// what() is "device: call failed with NAME (code): detail".
    DeviceError(std::string device, std::string call, int code, std::string detail);

    const std::string& device() const { return device_; }
    const std::string& call() const { return call_; }
    int code() const { return code_; }

private:
    std::string device_;
    std::string call_;
    int code_;
};

/// The file system refuses: a file cannot be written, a disk is full.
class CASTOR_API FileError : public Error {
public:
    /// what() is "file: reason".
    FileError(std::string file, std::string reason);

    const std::string& file() const { return file_; }

private:
    std::string file_;
};

/// What the caller asked for does not exist: an unknown device, strategy, plane or file type.
class CASTOR_API UsageError : public Error {
public:
    using Error::Error;
};

/// A ProgressHook said not to go on.
class CASTOR_API Interrupted : public Error {
public:
    Interrupted();
};

}  // namespace castor
