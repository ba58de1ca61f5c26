#include "progress_bar.h"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string_view>
#include <utility>
#include <vector>

#include "report.h"

namespace castor::cli {

namespace {

constexpr double kRedrawSeconds = 0.1;
constexpr double kLineSeconds = 5.0;

std::string duration(double seconds) {
    const auto whole = static_cast<long long>(seconds + 0.5);
    if (whole >= 3600) return fmt::format("{} h {:02} min", whole / 3600, whole / 60 % 60);
    if (whole >= 60) return fmt::format("{} min {:02} s", whole / 60, whole % 60);
    return fmt::format("{} s", whole);
}

/// Returns the rate in rays, or in samples until the first piece is finished: rays are counted when pieces end.
std::string rate(const RenderProgress& progress) {
    if (progress.seconds <= 0.0) return "";
    const bool has_rays = progress.rays > 0;
    const double per_second =
        static_cast<double>(has_rays ? progress.rays : progress.samples_done - progress.samples_resumed) /
        progress.seconds;
    const std::string_view unit = has_rays ? "ray" : "sample";
    if (per_second < 1e6) return fmt::format("{:.1f} k{}/s", per_second / 1e3, unit);
    return fmt::format("{:.1f} M{}/s", per_second / 1e6, unit);
}

/// Returns each device's share of the finished samples in per cent: "70+30 %". Where several hosts have some, their
/// names stand before theirs: "alpha 40+30, beta 30 %"; of many hosts only the number.
std::string shares(const RenderProgress& progress) {
    constexpr std::size_t kMostNamed = 4;
    std::uint64_t all = 0;
    for (const DeviceShare& share : progress.devices) all += share.samples;
    std::vector<std::pair<std::string, std::string>> hosts;  // their names, and the shares of their devices
    for (const DeviceShare& share : progress.devices) {
        const std::size_t colon = share.device.find(": ");  // see label(Device)
        const std::string host = colon == std::string::npos ? "" : share.device.substr(0, colon);
        if (hosts.empty() || hosts.back().first != host) hosts.emplace_back(host, "");
        std::string& text = hosts.back().second;
        const double part = all > 0 ? 100.0 * static_cast<double>(share.samples) / static_cast<double>(all) : 0.0;
        text += fmt::format("{}{:.0f}", text.empty() ? "" : "+", part);
    }
    if (hosts.size() == 1) return hosts.front().second + " %";
    if (hosts.size() > kMostNamed) return fmt::format("{} hosts", hosts.size());
    std::string text;
    for (const auto& [host, parts] : hosts) text += fmt::format("{}{} {}", text.empty() ? "" : ", ", host, parts);
    return text + " %";
}

std::string render_figures(const RenderProgress& progress, double fraction) {
    std::string text = fmt::format("{:3.0f} %, {}", std::min(100.0 * fraction, 100.0), rate(progress));
    if (progress.devices.size() > 1) text += fmt::format(" ({})", shares(progress));
    const auto now_done = static_cast<double>(progress.samples_done - progress.samples_resumed);
    const auto left = static_cast<double>(progress.samples_total - progress.samples_done);
    if (now_done > 0.0) text += fmt::format(", {} left", duration(progress.seconds * left / now_done));
    return text;
}

}  // namespace

bool is_terminal() {
    const char* kind = std::getenv("TERM");
    return ::isatty(STDERR_FILENO) && kind && std::string_view(kind) != "dumb";
}

std::size_t terminal_columns() {
    winsize size{};
    const bool known = ::ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0;
    return known ? size.ws_col : 80;
}

std::string figures(double fraction, double seconds) {
    return fmt::format("{:3.0f} %, {} left", std::min(100.0 * fraction, 100.0),
                       duration(std::max(0.0, seconds * (1.0 - fraction) / fraction)));
}

void draw_line(const std::string& text) {
    say(fmt::format("\r{}\033[K", text.substr(0, terminal_columns() - 1)));
    std::fflush(stderr);
}

void draw_bar(const std::string& label, const std::string& figures, double fraction) {
    const std::string text = fmt::format("{}{}{}", label, label.empty() ? "" : " ", figures);
    const std::size_t columns = terminal_columns();
    std::string bar;
    constexpr std::size_t kLongest = 40, kShortest = 10, kFrame = 4;  // brackets, a space, and the last column
    if (columns >= text.size() + kFrame + kShortest) {
        const std::size_t length = std::min(columns - text.size() - kFrame, kLongest);
        const auto filled = std::min(static_cast<std::size_t>(fraction * static_cast<double>(length)), length);
        bar = fmt::format("[{}{}] ", std::string(filled, '#'), std::string(length - filled, '.'));
    }
    draw_line(bar + text);
}

void erase_line() {
    say("\r\033[K");
}

// The first plain line comes after some seconds, so that a short render has none.
ProgressBar::ProgressBar(std::string label, bool quiet)
    : label_(std::move(label)),
      quiet_(quiet),
      terminal_(is_terminal()),
      next_seconds_(terminal_ ? 0.0 : kLineSeconds) {}

ProgressBar::~ProgressBar() {
    if (drawn_) erase_line();
}

void ProgressBar::show(const RenderProgress& progress) {
    for (const std::string& notice : progress.notices) {
        if (drawn_) erase_line();
        note("warning: {}", notice);
    }
    if (quiet_ || watch_.seconds() < next_seconds_ || progress.samples_total == 0) return;
    const double fraction = static_cast<double>(progress.samples_done) / static_cast<double>(progress.samples_total);
    const std::string text = render_figures(progress, fraction);
    if (terminal_)
        draw_bar(label_, text, fraction);
    else
        note("{}{}{}", label_, label_.empty() ? "" : ": ", text);
    drawn_ |= terminal_;
    next_seconds_ = watch_.seconds() + (terminal_ ? kRedrawSeconds : kLineSeconds);
}

}  // namespace castor::cli
