#pragma once

#include <vector>

#include "castor/renderer.h"
#include "render/render_job.h"

namespace castor {

/// Renders a share of a finished picture once more, each block by another of at least two workers than the one that
/// finished it, and compares all bits of pixels and planes. `on_progress` may stop it. A worker that fails here is told
/// of by a notice, and its blocks are not compared.
Verification verify(RenderJob& job, const std::vector<PieceWorkerOffer>& workers, const RenderOptions& options,
                    const Deadlines& deadlines, const ProgressCallback& on_progress);

}  // namespace castor
