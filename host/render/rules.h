#pragma once

#include <cstdint>

#include "castor/renderer.h"

namespace castor {

/// Returns the CASTOR_RULE_... flags of a rule set.
std::uint32_t rule_flags(RuleSet rules);

}  // namespace castor
