#pragma once

namespace castor::cli {

/// From now on the first SIGINT (Ctrl-C) or SIGTERM is only noted, so that what is done can be written; a second one
/// ends the program at once.
void catch_interrupts();

/// Whether a signal was noted.
bool interrupted();

}  // namespace castor::cli
