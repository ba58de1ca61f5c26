#pragma once

#include <memory>
#include <vector>

#include "castor/renderer.h"
#include "remote/manager.h"
#include "render/render_job.h"

namespace castor {

/// How many jobs a verification is for a manager, and so for each rank, also where there is nothing to do in them.
inline constexpr int kVerificationJobs = 2;

/// Renders a share of a finished picture once more, each block by another worker than the one that finished it: of
/// another host, if there are several. Compares all bits of pixels and planes. `workers` and `manager`: those of the
/// job, which must be complete and have at least two workers. `on_progress` may stop it. A worker that fails here is
/// told of by a notice, and its blocks are not compared.
Verification verify(RenderJob& job, const std::vector<PieceWorkerOffer>& workers, const RenderOptions& options,
                    const Deadlines& deadlines, const ProgressCallback& on_progress, Manager* manager);

}  // namespace castor
