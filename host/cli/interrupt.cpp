#include "interrupt.h"

#include <unistd.h>

#include <atomic>
#include <csignal>
#include <initializer_list>

#include "exit_status.h"

namespace castor::cli {

namespace {

// Set by whichever thread the signal reaches, and read by the others.
std::atomic<bool> noted = false;
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler may touch no other atomic");

extern "C" void note_signal(int signal) {
    // A terminal that is closed may send SIGHUP twice.
    if (noted.exchange(true) && signal != SIGHUP) ::_exit(static_cast<int>(ExitStatus::interrupted));
}

}  // namespace

void catch_interrupts() {
    struct sigaction action {};
    action.sa_handler = note_signal;
    action.sa_flags = SA_RESTART;  // no read or write fails for it
    sigemptyset(&action.sa_mask);
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
        struct sigaction before {};
        ::sigaction(signal, nullptr, &before);
        if (signal == SIGHUP && before.sa_handler == SIG_IGN) continue;  // nohup
        ::sigaction(signal, &action, nullptr);
    }
}

bool interrupted() {
    return noted;
}

}  // namespace castor::cli
