#include "progress.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <utility>

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

namespace thermbal {
namespace {

using std::chrono::milliseconds;

std::string clock_text(double seconds) {
    const auto whole = std::llround(seconds);
    if (whole >= 3600) return fmt::format("{}:{:02}:{:02}", whole / 3600, whole / 60 % 60, whole % 60);
    return fmt::format("{:02}:{:02}", whole / 60, whole % 60);
}

bool somebody_watches() {
    const char* const terminal =
        std::getenv("TERM");  // NOLINT(concurrency-mt-unsafe): nobody here sets variables
    return isatty(STDERR_FILENO) == 1 && terminal != nullptr && std::string_view(terminal) != "dumb";
}

std::size_t terminal_columns() {
    winsize size{};
    return ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : 80;
}

}  // namespace

std::string progress_line(const ProgressState& state, std::size_t columns) {
    std::string line = state.what;
    if (!state.step.empty()) line += ", " + state.step;
    if (state.share) line += fmt::format("  {:3.0f} %", 100.0 * std::clamp(*state.share, 0.0, 1.0));
    line += "  " + clock_text(state.elapsed_s) + " so far";
    // From a first hundredth nothing can be told of the rest.
    if (state.share && *state.share > 0.01 && *state.share <= 1.0)
        line +=
            fmt::format(", about {} left", clock_text(state.elapsed_s * (1.0 - *state.share) / *state.share));
    // A line as wide as the terminal would wrap in some, and could not be wiped.
    return line.substr(0, columns > 1 ? columns - 1 : 0);
}

Progress::Progress(std::string what) {
    if (somebody_watches()) thread_ = std::thread([this, what = std::move(what)] { run(what); });
}

Progress::~Progress() {
    if (!thread_.joinable()) return;
    {
        const std::lock_guard lock(mutex_);
        ended_ = true;
    }
    changed_.notify_all();
    thread_.join();
}

void Progress::set(double share) {
    share_ = share;
}

void Progress::follow(std::function<double()> share_of_now) {
    const std::lock_guard lock(mutex_);
    share_of_now_ = std::move(share_of_now);
}

ParallelFor Progress::counting(ParallelFor parallel_for) {
    return [this, parallel_for = std::move(parallel_for)](std::size_t count,
                                                          const std::function<void(std::size_t)>& body) {
        const auto done = std::make_shared<std::atomic<std::size_t>>(0);
        ++step_;
        share_ = 0.0;
        parallel_for(count, [&](std::size_t i) {
            body(i);
            share_ = static_cast<double>(++*done) / static_cast<double>(count);
        });
    };
}

void Progress::run(std::string what) {
    constexpr milliseconds first_after(2000);
    constexpr milliseconds every(500);
    const auto began = std::chrono::steady_clock::now();
    auto step_began = began;
    int step = 0;
    bool shown = false;
    std::unique_lock lock(mutex_);
    while (!changed_.wait_for(lock, shown ? every : first_after, [this] { return ended_; })) {
        const auto now = std::chrono::steady_clock::now();
        if (share_of_now_) share_ = share_of_now_();
        if (step != step_) {
            step = step_;
            step_began = now;
        }
        const double share = share_;
        // Of a work in steps nobody knows how many come: the time is that of the step.
        const auto since = step > 1 ? step_began : began;
        const ProgressState state{what, std::chrono::duration<double>(now - since).count(),
                                  share < 0.0 ? std::nullopt : std::optional(share),
                                  step > 1 ? fmt::format("step {}", step) : ""};
        fmt::print(stderr, "\r\033[K{}", progress_line(state, terminal_columns()));
        std::fflush(stderr);
        shown = true;
    }
    if (shown) fmt::print(stderr, "\r\033[K");
    std::fflush(stderr);
}

}  // namespace thermbal
