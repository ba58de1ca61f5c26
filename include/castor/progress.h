#pragma once

#include <functional>

namespace castor {

/// A function that a long operation calls up to about a thousand times, with the fraction that is done: above 0, larger
/// at each call, and 1 at the end. It returns whether to go on; after false, the operation soon throws Interrupted.
/// Calls come from any thread, but never from two at once. The function must not throw.
using ProgressHook = std::function<bool(double fraction)>;

}  // namespace castor
