#pragma once

#include <cstddef>
#include <string>

#include "base/stopwatch.h"
#include "castor/renderer.h"

namespace castor::cli {

/// Whether standard error is a terminal that can redraw a line, and how wide it is.
bool is_terminal();
std::size_t terminal_columns();

/// "42 %, 3 s left" of what took so many seconds up to a share of it above 0.
std::string figures(double fraction, double seconds);

/// Redraw the terminal's line: with a text cut to its width; with a bar as long as there is room for, and the texts;
/// with nothing.
void draw_line(const std::string& text);
void draw_bar(const std::string& label, const std::string& figures, double fraction);
void erase_line();

/// Shows on standard error how far a render is: a bar with rate and time left that redraws itself on a terminal, a
/// plain line every few seconds elsewhere, nothing if `quiet`; but notices always.
class ProgressBar {
public:
    /// `label` stands before the bar, such as "camera 2/3"; it may be empty.
    ProgressBar(std::string label, bool quiet);
    ~ProgressBar();
    ProgressBar(const ProgressBar&) = delete;
    ProgressBar& operator=(const ProgressBar&) = delete;

    void show(const RenderProgress& progress);

private:
    std::string label_;
    bool quiet_;
    bool terminal_;
    bool drawn_ = false;
    Stopwatch watch_;
    double next_seconds_;
};

}  // namespace castor::cli
