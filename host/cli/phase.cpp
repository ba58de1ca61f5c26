#include "phase.h"

#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <mutex>
#include <stop_token>

#include "progress_bar.h"
#include "report.h"
#include "stopwatch.h"

namespace castor::cli {

namespace {

/// Until it is to stop. Moves every tenth of a second, as a bar does.
void show_until(const std::stop_token& stop, const std::string& label) {
    const bool terminal = is_terminal();
    const Stopwatch watch;
    double next_seconds = terminal ? 0.5 : 5.0;
    bool drawn = false;
    std::mutex mutex;
    std::condition_variable_any wake;
    std::unique_lock lock(mutex);
    while (!wake.wait_for(lock, stop, std::chrono::milliseconds(100), [&] { return stop.stop_requested(); })) {
        const double seconds = watch.seconds();
        if (seconds < next_seconds) continue;
        if (terminal) {
            constexpr int kPlaces = 10;
            const int place = static_cast<int>(seconds * 10) % kPlaces;
            std::string bar(kPlaces, '.');
            bar[static_cast<std::size_t>(place)] = '#';
            const std::string text = fmt::format("[{}] {}, {:.0f} s", bar, label, seconds);
            fmt::print(stderr, "\r{}\033[K", text.substr(0, terminal_columns() - 1));
            std::fflush(stderr);
            drawn = true;
        } else {
            note("{}: {:.0f} s", label, seconds);
        }
        next_seconds = seconds + (terminal ? 0.1 : 5.0);
    }
    if (drawn) std::fputs("\r\033[K", stderr);
}

}  // namespace

Phase::Phase(std::string label, bool quiet) {
    if (!quiet)
        thread_ = std::jthread([text = std::move(label)](const std::stop_token& stop) { show_until(stop, text); });
}

}  // namespace castor::cli
