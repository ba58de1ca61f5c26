#pragma once

#include <memory>
#include <vector>

#include "castor/renderer.h"
#include "render/render_job.h"

namespace castor {

/// Makes a share of a finished picture once more, each block on another of at least two devices than before, and
/// compares all bits of pixels and planes. `on_progress` may stop it. A device that fails here is told of by a notice,
/// and what it was to compare is not compared.
Verification verify(RenderJob& job, const WaveSettings& settings,
                    const std::vector<std::shared_ptr<SceneDevice>>& devices, const RenderOptions& options,
                    const Deadlines& deadlines, const ProgressCallback& on_progress);

}  // namespace castor
