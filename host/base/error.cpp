#include "castor/error.h"

#include <fmt/format.h>

#include "base/status_name.h"

namespace castor {

namespace {

std::string scene_message(const std::string& file, std::size_t line, const std::string& reason) {
    if (file.empty()) return reason;
    if (line == 0) return fmt::format("{}: {}", file, reason);
    return fmt::format("{}:{}: {}", file, line, reason);
}

std::string device_message(const std::string& device, const std::string& call, int code, const std::string& detail) {
    std::string message = device;
    if (!call.empty()) {
        if (!message.empty()) message += ": ";
        message += code == 0 ? call : fmt::format("{} failed with {} ({})", call, status_name(code), code);
    }
    if (!detail.empty()) {
        if (!message.empty()) message += ": ";
        message += detail;
    }
    return message;
}

}  // namespace

SceneError::SceneError(std::string file, std::size_t line, std::string reason)
    : Error(scene_message(file, line, reason)), file_(std::move(file)), line_(line), reason_(std::move(reason)) {}

DeviceError::DeviceError(std::string device, std::string call, int code, std::string detail)
    : Error(device_message(device, call, code, detail)),
      device_(std::move(device)),
      call_(std::move(call)),
      code_(code) {}

FileError::FileError(std::string file, std::string reason)
    : Error(fmt::format("{}: {}", file, reason)), file_(std::move(file)) {}

Interrupted::Interrupted() : Error("interrupted") {}

}  // namespace castor
