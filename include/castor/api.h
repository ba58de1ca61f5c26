#pragma once

/// CASTOR_API marks what a shared libcastor exports: all else in it is hidden. CASTOR_HIDDEN marks what is hidden
/// within a class that is exported.
#if defined(__GNUC__)
#define CASTOR_API __attribute__((visibility("default")))
#define CASTOR_HIDDEN __attribute__((visibility("hidden")))
#else
#define CASTOR_API
#define CASTOR_HIDDEN
#endif
