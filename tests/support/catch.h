#pragma once

#include "support/reference.h"

// Includes Catch2: version 3, or version 2, which Debian 12 packages.
#if __has_include(<catch2/catch_all.hpp>)
#include <catch2/catch_all.hpp>
using Catch::Approx;
#else
#include <catch2/catch.hpp>
#endif
