#include "acquisition/scan.hpp"

#include <algorithm>
#include <utility>

namespace thermbal {

ScanAssembler::ScanAssembler(Grid grid, std::uint64_t generation, std::int64_t first_scan,
                             std::vector<std::size_t> channel_line, std::size_t lines)
    : grid_(grid),
      generation_(generation),
      next_(first_scan),
      channel_line_(std::move(channel_line)),
      waiting_(lines) {}

void ScanAssembler::add(LineScan reading) {
    if (reading.generation != generation_ || reading.scan < next_ || reading.line >= waiting_.size()) return;
    auto& waiting = waiting_[reading.line];
    if (!waiting.empty() && waiting.back().scan >= reading.scan) return;
    waiting.push_back(std::move(reading));
}

std::vector<Scan> ScanAssembler::take_closed(std::int64_t now_ns, std::int64_t wall_ns, std::size_t most) {
    std::vector<Scan> closed;
    const auto every_line_is_past = [this] {
        return std::ranges::all_of(
            waiting_, [this](const auto& line) { return !line.empty() && line.back().scan >= next_; });
    };
    while (closed.size() < most && (every_line_is_past() || now_ns >= next_close_ns()))
        closed.push_back(close(now_ns, wall_ns));
    return closed;
}

Scan ScanAssembler::close(std::int64_t now_ns, std::int64_t wall_ns) {
    const std::int64_t late_after_ns = grid_.period_ns / 10;
    Scan scan;
    scan.scan = next_;
    scan.due_ns = grid_.due_ns(next_);
    scan.wall_ns = wall_ns - (now_ns - scan.due_ns);
    scan.samples.resize(channel_line_.size());
    bool any = false;
    for (auto& line : waiting_) {
        if (line.empty() || line.front().scan != next_) continue;
        const LineScan& reading = line.front();
        for (const auto& [channel, sample] : reading.samples) scan.samples[channel] = sample;
        scan.started_ns = any ? std::min(scan.started_ns, reading.started_ns) : reading.started_ns;
        scan.finished_ns = std::max(scan.finished_ns, reading.finished_ns);
        if (!any || reading.wall_ns < scan.wall_ns) scan.wall_ns = reading.wall_ns;
        if (reading.started_ns - scan.due_ns > late_after_ns) scan.status = ScanStatus::late;
        if (!any && scan.status != ScanStatus::late) scan.status = ScanStatus::ok;
        any = true;
    }
    for (std::size_t channel = 0; any && channel < scan.samples.size(); ++channel) {
        const auto& line = waiting_[channel_line_[channel]];
        const bool was_read = !line.empty() && line.front().scan == next_;
        // The scan took place, this line took no part in it: that is a silent line, not a gap of the grid.
        if (!was_read) scan.samples[channel].quality = Quality::communication;
    }
    for (auto& line : waiting_) {
        if (!line.empty() && line.front().scan == next_) line.erase(line.begin());
    }
    ++next_;
    return scan;
}

}  // namespace thermbal
