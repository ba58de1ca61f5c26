#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace castor::kernels {

/// Name, as an #include line spells it, and text of each embedded source.
using SourceTable = std::vector<std::pair<std::string_view, std::string_view>>;

extern const SourceTable library_kernels;

/// Returns the text of `name` with every #include "..." replaced by the text of that source, each once, after the
/// pragma that forbids contraction, with #line directives so that a build log names our files and lines. Sources are
/// looked up in the folder that the environment variable CASTOR_KERNEL_DIR names (as kernels/NAME, include/NAME or
/// tests/kernels/NAME below it: the root of a source tree), if it is set, then in `extra`, then in library_kernels.
///
/// A source NAME.lanes.cl is a template: `#include "NAME.x4.cl"` inserts its text with CASTOR_LANES defined as 4, once
/// for each number, with names and types for so many lanes in the place of LANES(name), Real, Whole, Int and Mask. A
/// template includes another one for its own number by `#include "OTHER.lanes.cl"`. Ordinary sources that a template
/// includes do not see CASTOR_LANES. kernels/device/lanes.cl shows how to write one.
///
/// `prelude`, unless it is empty, names a source whose text stands before all.
///
/// Throws DeviceError if a source is missing, naming the file that includes it, or if a template is included without a
/// number, or if CASTOR_KERNEL_DIR names no folder with kernels/ in it.
std::string expand_kernel_source(std::string_view name, const SourceTable& extra = {}, std::string_view prelude = {});

}  // namespace castor::kernels
