#pragma once

#include <cstddef>
#include <string>

#include "base/stopwatch.h"
#include "castor/renderer.h"

namespace castor::cli {

/// Return whether standard error is a terminal that can redraw a line, and its width.
bool is_terminal();
std::size_t terminal_columns();

/// Returns "42 %, 3 s left" for work that took `seconds` up to `fraction`, which is above 0.
std::string figures(double fraction, double seconds);

/// Redraw the terminal's line: with a text, cut to the width; with the texts and a bar as long as there is room for;
/// with nothing.
void draw_line(const std::string& text);
void draw_bar(const std::string& label, const std::string& figures, double fraction);
void erase_line();

/// A display of a render's progress on standard error: a bar with rate and time left that redraws itself on a terminal,
/// a plain line every few seconds elsewhere, nothing if `quiet`. Notices are always shown.
class ProgressBar {
public:
    /// `label` stands before the figures, such as "picture 2/3"; it may be empty.
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
