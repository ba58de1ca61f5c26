#pragma once

#include <cstddef>
#include <string>

#include "castor/renderer.h"
#include "stopwatch.h"

namespace castor::cli {

/// Whether standard error is a terminal that can redraw a line, and how wide it is.
bool is_terminal();
std::size_t terminal_columns();

/// Shows on standard error how far a render is: a bar with rate and time left that redraws itself on a terminal, a
/// plain line every few seconds elsewhere, nothing if `quiet`.
class ProgressBar {
public:
    /// `label` stands before the bar, such as "camera 2/3"; it may be empty.
    ProgressBar(std::string label, bool quiet);
    ~ProgressBar();
    ProgressBar(const ProgressBar&) = delete;
    ProgressBar& operator=(const ProgressBar&) = delete;

    void show(const RenderProgress& progress);

private:
    void redraw(const RenderProgress& progress, double fraction);

    std::string label_;
    bool quiet_;
    bool terminal_;
    bool drawn_ = false;
    Stopwatch watch_;
    double next_seconds_;
};

}  // namespace castor::cli
