#pragma once

#include <nlohmann/json.hpp>

#include "castor/device.h"

namespace castor {

/// Keys stay in the order in which they are set.
using Json = nlohmann::ordered_json;

/// What a device is and can do, for programs.
Json json_of(const Device& device);
/// The device that json_of(device) describes, but without `platform` and `id`.
Device device_of(const Json& document);

}  // namespace castor
