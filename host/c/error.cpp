// Versions, and what is told of errors.
#include <cstdlib>
#include <exception>
#include <new>
#include <stdexcept>
#include <string>

#include "c/call.h"

static_assert(CASTOR_C_VERSION == CASTOR_VERSION_NUMBER, "castor_c.h has the project's version");

namespace castor::c {

namespace {

struct LastError {
    castor_status status = CASTOR_STATUS_DONE;
    int code = 0;
    std::size_t line = 0;
    std::string message, device, call, file;
};

thread_local LastError last_error;

LastError describe_current_exception(const char* function) {
    const auto with_message = [](castor_status status, std::string message) {
        LastError error;
        error.status = status;
        error.message = std::move(message);
        return error;
    };
    try {
        throw;
    } catch (const Interrupted& error) {
        return with_message(CASTOR_STATUS_STOPPED, error.what());
    } catch (const ArgumentError& error) {
        return with_message(CASTOR_STATUS_USAGE_ERROR, fmt::format("{}: {}", function, error.what()));
    } catch (const UsageError& error) {
        return with_message(CASTOR_STATUS_USAGE_ERROR, error.what());
    } catch (const SceneError& error) {
        LastError last = with_message(CASTOR_STATUS_SCENE_ERROR, error.what());
        last.file = error.file();
        last.line = error.line();
        return last;
    } catch (const FileError& error) {
        LastError last = with_message(CASTOR_STATUS_FILE_ERROR, error.what());
        last.file = error.file();
        return last;
    } catch (const DeviceError& error) {
        LastError last = with_message(CASTOR_STATUS_DEVICE_ERROR, error.what());
        last.device = error.device();
        last.call = error.call();
        last.code = error.code();
        return last;
    } catch (const std::bad_alloc&) {
        return with_message(CASTOR_STATUS_OUT_OF_MEMORY, fmt::format("{}: the host has too little memory", function));
    } catch (const std::length_error&) {
        return with_message(CASTOR_STATUS_OUT_OF_MEMORY, fmt::format("{}: more than memory can hold", function));
    } catch (const std::exception& error) {
        return with_message(CASTOR_STATUS_INTERNAL_ERROR, fmt::format("{}: {}", function, error.what()));
    } catch (...) {
        return with_message(CASTOR_STATUS_INTERNAL_ERROR, fmt::format("{}: unknown exception", function));
    }
}

}  // namespace

castor_status store_current_exception(const char* function) noexcept {
    try {
        last_error = describe_current_exception(function);
    } catch (...) {
        // There is no memory for the message, either; short strings need none.
        last_error = LastError();
        last_error.status = CASTOR_STATUS_OUT_OF_MEMORY;
        last_error.message = "out of memory";
    }
    return last_error.status;
}

}  // namespace castor::c

using castor::c::last_error;

uint32_t castor_version(void) {
    return CASTOR_VERSION_NUMBER;
}

const char* castor_version_string(void) {
    return CASTOR_VERSION;
}

const char* castor_status_string(castor_status status) {
    static const char* const words[] = {"done",         "stopped",    "scene error",   "usage error",
                                        "device error", "file error", "out of memory", "internal error"};
    return status >= 0 && static_cast<std::size_t>(status) < std::size(words) ? words[status] : "unknown status";
}

const char* castor_last_error_message(void) {
    return last_error.message.c_str();
}

castor_status castor_get_last_error(castor_error* error) {
    return castor::c::guarded([&] {
        castor_error told{};
        told.status = last_error.status;
        told.code = last_error.code;
        told.message = last_error.message.c_str();
        told.device = last_error.device.c_str();
        told.call = last_error.call.c_str();
        told.file = last_error.file.c_str();
        told.line = last_error.line;
        castor::c::write_struct(error, told, "error");
    });
}
