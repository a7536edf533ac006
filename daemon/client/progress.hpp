#pragma once

#include <atomic>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "base/parallel.hpp"

namespace thermbal {

/// How far something is. Where `share` (0 ... 1) is empty nobody knows, and only the time is said.
struct ProgressState {
    std::string what;
    double elapsed_s = 0.0;
    std::optional<double> share;
    std::string step;  ///< which part of the work `share` belongs to; empty: all of it
};

/// One line of at most `columns` characters: "replay  43 %  00:12 so far, about 00:16 left". A pure function.
std::string progress_line(const ProgressState& state, std::size_t columns);

/// What a command that works for long says of itself: after 2 s, twice a second, one line on standard error
/// that it wipes away at its end. Says nothing when standard error is no terminal. set() and counting() may
/// be called from any thread.
class Progress {
  public:
    explicit Progress(std::string what);
    Progress(const Progress&) = delete;
    Progress& operator=(const Progress&) = delete;
    ~Progress();

    void set(double share);

    /// The same work, counted: `share` follows the call of it that is going on.
    ParallelFor counting(ParallelFor parallel_for);

    /// Asked before each line: for work that tells nobody how far it is. Called on a thread of its own.
    void follow(std::function<double()> share_of_now);

  private:
    void run(std::string what);

    std::atomic<double> share_ = -1.0;  ///< below 0: not known
    std::atomic<int> step_ = 0;
    std::mutex mutex_;
    std::condition_variable changed_;
    bool ended_ = false;                    ///< guarded by mutex_
    std::function<double()> share_of_now_;  ///< guarded by mutex_
    std::thread thread_;                    ///< only at a terminal
};

}  // namespace thermbal
