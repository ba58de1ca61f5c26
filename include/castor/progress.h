#pragma once

#include <functional>

namespace castor {

/// Called now and then, at most a thousand times or so, while something long goes on, with the share of it that is
/// done: above 0, more each time, and 1 at the end. Returns whether to go on; if not, what goes on throws Interrupted
/// soon. Comes from any thread, but never from two at once; it must not throw.
using ProgressHook = std::function<bool(double fraction)>;

}  // namespace castor
