#include "interrupt.h"

#include <unistd.h>

#include <csignal>

#include "exit_status.h"

namespace castor::cli {

namespace {

volatile std::sig_atomic_t noted = 0;

extern "C" void note_signal(int) {
    if (noted) ::_exit(static_cast<int>(ExitStatus::interrupted));
    noted = 1;
}

}  // namespace

void catch_interrupts() {
    struct sigaction action {};
    action.sa_handler = note_signal;
    action.sa_flags = SA_RESTART;  // no read or write fails for it
    sigemptyset(&action.sa_mask);
    ::sigaction(SIGINT, &action, nullptr);
    ::sigaction(SIGTERM, &action, nullptr);
}

bool interrupted() {
    return noted != 0;
}

}  // namespace castor::cli
