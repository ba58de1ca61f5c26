#pragma once

namespace castor::cli {

/// From now on the first SIGINT (Ctrl-C), SIGTERM or SIGHUP is only noted, so that what is done can be written; a
/// second one ends the program at once, unless it is SIGHUP. Where SIGHUP is ignored, as nohup lets it be, it stays so.
void catch_interrupts();

/// What Renderer and Tracer get as their stop deadline: Ctrl-C answers within 0.3 s, and fast devices do not wait for
/// those whose driver still compiles.
constexpr double kStopDeadlineSeconds = 0.12;

/// Whether a signal was noted.
bool interrupted();

}  // namespace castor::cli
