// The headers of other projects that most tests include. Every test still includes what it uses.
#pragma once

#include "opencl/precompiled.h"
#include "support/catch.h"
