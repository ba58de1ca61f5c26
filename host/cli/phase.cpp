#include "phase.h"

#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <mutex>
#include <stop_token>

#include "base/stopwatch.h"
#include "interrupt.h"
#include "progress_bar.h"
#include "report.h"

namespace castor::cli {

namespace {

void draw(const std::string& label, double fraction, double seconds) {
    constexpr int kPlaces = 10;
    if (fraction > 0.0) return draw_bar(label, figures(fraction, seconds), fraction);
    std::string bar(kPlaces, '.');
    bar[static_cast<std::size_t>(seconds * 10) % kPlaces] = '#';
    draw_line(fmt::format("[{}] {}, {:.0f} s", bar, label, seconds));
}

void note_progress(const std::string& label, double fraction, double seconds) {
    if (fraction > 0.0)
        note("{}: {}", label, figures(fraction, seconds));
    else
        note("{}: {:.0f} s", label, seconds);
}

/// Shows progress until a stop is requested; redraws every tenth of a second.
void show_until(const std::stop_token& stop, const std::string& label, const std::atomic<double>& fraction) {
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
        if (terminal)
            draw(label, fraction, seconds);
        else
            note_progress(label, fraction, seconds);
        drawn |= terminal;
        next_seconds = seconds + (terminal ? 0.1 : 5.0);
    }
    if (drawn) erase_line();
}

}  // namespace

Phase::Phase(std::string label, bool quiet) {
    if (!quiet)
        thread_ = std::jthread(
            [this, text = std::move(label)](const std::stop_token& stop) { show_until(stop, text, fraction_); });
}

ProgressHook Phase::hook() {
    return [this](double fraction) {
        fraction_ = fraction;
        return !interrupted();
    };
}

}  // namespace castor::cli
