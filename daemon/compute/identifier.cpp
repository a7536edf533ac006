#include "compute/identifier.hpp"

#include <chrono>
#include <utility>

#include "compute/threads.hpp"

namespace thermbal {

Identifier::Identifier(Identify identify, std::function<void(IdentificationResult)> done)
    : identify_(std::move(identify)),
      done_(std::move(done)),
      thread_([this](const std::stop_token& stop) { run(stop); }) {}

Identifier::~Identifier() {
    cancel();
    thread_.request_stop();
}

void Identifier::submit(IdentificationJob job) {
    {
        const std::lock_guard lock(mutex_);
        waiting_ = std::move(job);
    }
    changed_.notify_all();
}

void Identifier::cancel() {
    const std::lock_guard lock(mutex_);
    waiting_.reset();
    cancelled_before_ = job_number_ + 1;
}

bool Identifier::busy() const {
    const std::lock_guard lock(mutex_);
    return working_ || waiting_.has_value();
}

void Identifier::run(const std::stop_token& stop) {
    put_this_thread_last();
    for (;;) {
        IdentificationJob job;
        std::uint64_t number = 0;
        {
            std::unique_lock lock(mutex_);
            working_ = false;
            if (!changed_.wait(lock, stop, [this] { return waiting_.has_value(); })) return;
            job = std::move(*waiting_);
            waiting_.reset();
            working_ = true;
            number = ++job_number_;
        }
        const auto cancelled = [&] {
            const std::lock_guard lock(mutex_);
            return number < cancelled_before_;
        };
        const auto started = std::chrono::steady_clock::now();
        auto verdict = identify_(job, cancelled);
        const std::chrono::duration<double> took = std::chrono::steady_clock::now() - started;
        if (!cancelled()) done_({job.generation, job.window_end_scan, took.count(), std::move(verdict)});
    }
}

}  // namespace thermbal
