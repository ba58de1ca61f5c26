// Headers of others that most tests include. Every test includes what it uses all the same.
#pragma once

#include "opencl/precompiled.h"
#include "support/catch.h"
