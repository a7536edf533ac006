#include "acquisition/line_reader.hpp"

#include <algorithm>
#include <utility>

#include "acquisition/scan_thread.hpp"

namespace thermbal {

LineReader::LineReader(std::size_t index, Line& line, Clock& clock, Mailbox<LineScan>& mailbox)
    : index_(index),
      line_(line),
      clock_(clock),
      mailbox_(mailbox),
      thread_([this](const std::stop_token& stop) { run(stop); }) {}

LineReader::~LineReader() {
    thread_.request_stop();
    clock_.wake();
}

void LineReader::follow(Grid grid, std::uint64_t generation, std::int64_t first_scan) {
    {
        const std::lock_guard lock(mutex_);
        plan_ = Plan{grid, generation, first_scan};
    }
    changed_.notify_all();
    clock_.wake();
}

void LineReader::write(RegisterWrite write, std::function<void(Result<void>)> done) {
    {
        const std::lock_guard lock(mutex_);
        writes_.push_back({write, std::move(done)});
    }
    changed_.notify_all();
    clock_.wake();
}

void LineReader::carry_out_writes() {
    std::vector<PendingWrite> writes;
    {
        const std::lock_guard lock(mutex_);
        writes.swap(writes_);
    }
    for (const PendingWrite& pending : writes) pending.done(line_.write(pending.write));
}

void LineReader::run(const std::stop_token& stop) {
    put_scan_thread_first();
    while (!stop.stop_requested()) {
        const std::uint64_t seen_wakes = clock_.wakes();
        carry_out_writes();
        Plan plan;
        {
            std::unique_lock lock(mutex_);
            if (!changed_.wait(lock, stop, [this] { return plan_.has_value() || !writes_.empty(); })) return;
            if (!writes_.empty()) continue;
            // The grid decides what is due, not what was read last: a late thread skips.
            plan_->next_scan = std::max(plan_->next_scan, plan_->grid.scan_at(clock_.monotonic_ns()));
            plan = *plan_;
        }
        if (!clock_.sleep_until(plan.grid.due_ns(plan.next_scan), seen_wakes, stop)) continue;

        LineScan reading{index_, plan.generation, plan.next_scan, clock_.monotonic_ns(), 0, clock_.wall_ns(),
                         {}};
        reading.samples = line_.read_scan();
        reading.finished_ns = clock_.monotonic_ns();
        {
            const std::lock_guard lock(mutex_);
            if (plan_->generation == plan.generation) plan_->next_scan = plan.next_scan + 1;
        }
        mailbox_.push(std::move(reading));
    }
}

}  // namespace thermbal
