#pragma once

#include "castor/renderer.h"
#include "remote/manager.h"
#include "remote/rank_server.h"

namespace castor {

/// Renders as Renderer::render does, together with the manager's workers: the same picture. RenderStatistics::devices
/// then has these after the renderer's own.
Film render_together(Renderer& renderer, const Camera& camera, const RenderOptions& options,
                     const ProgressCallback& on_progress, Manager& manager);

/// Lets the renderer's devices work on the same picture for the manager, until it is done. Returns false if no further
/// one follows. Throws as Renderer::render, and DeviceError where the manager refuses this process, or is silent.
bool serve_render(Renderer& renderer, const Camera& camera, const RenderOptions& options, RankServer& server);

}  // namespace castor
