#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "daemon.hpp"

namespace thermbal {

Moment Daemon::now() const {
    return {clock_.wall_ns(), clock_.monotonic_ns()};
}

ScanRecord Daemon::record_of(const Scan& scan) const {
    ScanRecord record{scan.scan,    scan.status,  test_.grid.time_s(scan.scan),
                      scan.due_ns,  {},           {},
                      scan.wall_ns, scan.samples, {}};
    if (scan.status != ScanStatus::missed) {
        record.started_ns = scan.started_ns;
        record.finished_ns = scan.finished_ns;
    }
    return record;
}

void Daemon::store_scan(const Scan& scan) {
    // 16 channels x 15 s: about 40 hours of a disk that does not take anything.
    constexpr std::size_t most_unstored = 10'000;
    if (unstored_.size() == most_unstored) {
        unstored_.pop_front();
        ++lost_scans_;
    }
    const bool waiting_already = !unstored_.empty();
    unstored_.push_back(record_of(scan));
    const std::int64_t started_ns = real_monotonic_ns();
    const std::vector<ScanRecord> records(unstored_.begin(), unstored_.end());
    const auto stored = store_.append_scans(test_.id, records);
    commit_ms_.add(static_cast<double>(real_monotonic_ns() - started_ns) * 1e-6);
    if (stored) {
        unstored_.clear();
        if (waiting_already)
            event("storage_back", fmt::format("{} scans kept in memory are stored now", records.size()));
        return;
    }
    if (stored.error().next == NextStep::refuse_input) {
        lost_scans_ += unstored_.size();
        unstored_.clear();
        event("scan_refused",
              fmt::format("scan {} is refused by the database: {}", scan.scan, stored.error().message));
    } else if (!waiting_already) {
        spdlog::error("the database does not take scans: {}; they are kept in memory, up to {}",
                      stored.error().message, most_unstored);
    }
}

void Daemon::event(std::string_view kind, const std::string& message,
                   const std::optional<std::string>& channel) {
    EventRecord record{.id = 0,
                       .test_id = test_.id > 0 ? std::optional(test_.id) : std::nullopt,
                       .wall_ns = clock_.wall_ns(),
                       .time_s = {},
                       .kind = std::string(kind),
                       .channel = channel,
                       .message = message};
    if (record.test_id)
        record.time_s = static_cast<double>(clock_.monotonic_ns() - test_.grid.start_ns) * 1e-9;
    spdlog::info("{}: {}", kind, message);
    const auto id = store_.record_event(record);
    if (!id) spdlog::warn("an event is not stored: {}", id.error().message);
    server_.publish("event",
                    {{"id", id.value_or(0)},
                     {"kind", kind},
                     {"time_s", record.time_s ? nlohmann::json(*record.time_s) : nlohmann::json(nullptr)},
                     {"channel", channel ? nlohmann::json(*channel) : nlohmann::json(nullptr)},
                     {"message", message}});
}

}  // namespace thermbal
