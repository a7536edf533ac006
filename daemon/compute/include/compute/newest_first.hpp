#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "compute/threads.hpp"

namespace thermbal {

/// Works beside the scans: one job at a time on a thread of its own that gives way to all others, the newest
/// job first. A job that is still waiting when a newer one comes is dropped; one under way is finished,
/// unless cancel() is called.
template <typename Job, typename Outcome>
class NewestFirst {
  public:
    using Work = std::function<Outcome(const Job& job, const std::function<bool()>& cancelled)>;

    /// `done` is called on the worker's thread.
    NewestFirst(Work work, std::function<void(Outcome)> done)
        : work_(std::move(work)),
          done_(std::move(done)),
          thread_([this](const std::stop_token& stop) { run(stop); }) {}
    NewestFirst(const NewestFirst&) = delete;
    NewestFirst& operator=(const NewestFirst&) = delete;
    ~NewestFirst() {
        cancel();
        thread_.request_stop();
    }

    void submit(Job job) {
        {
            const std::lock_guard lock(mutex_);
            waiting_ = std::move(job);
        }
        changed_.notify_all();
    }

    /// Forgets the waiting job and ends the one under way as soon as it looks.
    void cancel() {
        const std::lock_guard lock(mutex_);
        waiting_.reset();
        cancelled_before_ = job_number_ + 1;
    }

  private:
    void run(const std::stop_token& stop) {
        put_this_thread_last();
        for (;;) {
            std::optional<Job> job;
            std::uint64_t number = 0;
            {
                std::unique_lock lock(mutex_);
                if (!changed_.wait(lock, stop, [this] { return waiting_.has_value(); })) return;
                job = std::exchange(waiting_, std::nullopt);
                number = ++job_number_;
            }
            const auto cancelled = [&] {
                const std::lock_guard lock(mutex_);
                return number < cancelled_before_;
            };
            Outcome outcome = work_(*job, cancelled);
            if (!cancelled()) done_(std::move(outcome));
        }
    }

    const Work work_;
    const std::function<void(Outcome)> done_;
    std::mutex mutex_;
    std::condition_variable_any changed_;
    std::optional<Job> waiting_;  // guarded by mutex_, as the rest
    std::uint64_t cancelled_before_ = 0;
    std::uint64_t job_number_ = 0;
    std::jthread thread_;  // last: it uses all of the above
};

}  // namespace thermbal
