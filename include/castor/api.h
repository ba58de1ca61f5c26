#pragma once

/// Marks what a shared libcastor exports. All else in it is hidden.
#if defined(__GNUC__)
#define CASTOR_API __attribute__((visibility("default")))
#else
#define CASTOR_API
#endif
