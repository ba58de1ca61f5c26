#include "interrupt.h"

#include <unistd.h>

#include <csignal>
#include <initializer_list>

#include "exit_status.h"

namespace castor::cli {

namespace {

volatile std::sig_atomic_t noted = 0;

extern "C" void note_signal(int signal) {
    // A terminal that goes may say so twice.
    if (noted && signal != SIGHUP) ::_exit(static_cast<int>(ExitStatus::interrupted));
    noted = 1;
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
    return noted != 0;
}

}  // namespace castor::cli
