#pragma once

#include "support/reference.h"

// Catch2 version 3, or version 2 as Debian 12 packages it.
#if __has_include(<catch2/catch_all.hpp>)
#include <catch2/catch_all.hpp>
using Catch::Approx;
#else
#include <catch2/catch.hpp>
#endif
