#pragma once

namespace castor::cli {

/// Catches SIGINT (Ctrl-C), SIGTERM and SIGHUP: the first one is only noted, so that what is done can be written; a
/// second one ends the program at once, unless it is SIGHUP. Where SIGHUP is ignored, as by nohup, it stays so.
void catch_interrupts();

/// What Renderer and Tracer get as their stop deadline: Ctrl-C answers within 0.3 s, and fast devices do not wait for
/// those whose driver still compiles.
constexpr double kStopDeadlineSeconds = 0.12;

/// Returns whether a signal was noted.
bool interrupted();

}  // namespace castor::cli
