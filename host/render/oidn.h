#pragma once

#include <cstdint>
#include <initializer_list>
#include <memory>
#include <optional>
#include <string>

#include "castor/film.h"

namespace castor {

struct OidnDevice;  // the library's own

/// Returns "Open Image Denoise 1.4.3" for 10403.
std::string name_of_oidn(std::uint32_t version);

/// Returns about how many bytes it takes to remove noise from so many pixels.
std::uint64_t bytes_of_oidn(std::uint64_t pixels);

/// Open Image Denoise, loaded and ready: see castor/denoise.h.
class Oidn {
public:
    /// Throws UsageError as oidn_version does.
    Oidn();
    ~Oidn();
    Oidn(const Oidn&) = delete;
    Oidn& operator=(const Oidn&) = delete;

    std::uint32_t version() const { return version_; }
    /// As denoise_by_oidn.
    void denoise(Film& film) const;

private:
    struct Functions;
    struct Image;

    std::optional<std::string> told_error() const;
    void run(const Film& film, bool of_picture, std::initializer_list<Image> images) const;

    std::unique_ptr<const Functions> functions_;
    std::unique_ptr<OidnDevice, void (*)(OidnDevice*)> device_{nullptr, nullptr};
    std::uint32_t version_ = 0;
};

}  // namespace castor
