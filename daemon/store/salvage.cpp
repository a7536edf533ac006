#include "salvage.hpp"

#include <cmath>
#include <ranges>
#include <utility>
#include <vector>

namespace thermbal {
namespace {

constexpr std::int64_t scans_a_transaction = 200;

ScanRecord missed_scan(const KnownTest& known, std::int64_t scan) {
    ScanRecord record;
    record.scan = scan;
    record.status = ScanStatus::missed;
    const std::int64_t since_start_ns = scan * std::llround(known.record.period_s * 1e9);
    record.time_s = static_cast<double>(since_start_ns) * 1e-9;
    record.scheduled_ns = known.record.started.monotonic_ns + since_start_ns;
    record.wall_ns = known.record.started.wall_ns + since_start_ns;
    return record;
}

/// Those of first ... last that can be read, one by one where they cannot together.
std::vector<ScanRecord> readable_scans(const Reader& damaged, TestId id, std::int64_t first,
                                       std::int64_t last) {
    auto scans = damaged.scans(id, first, last);
    if (scans) return std::move(*scans);
    std::vector<ScanRecord> readable;
    for (std::int64_t scan = first; scan <= last; ++scan) {
        auto one = damaged.scans(id, scan, scan);
        if (one && one->size() == 1) readable.push_back(std::move(one->front()));
    }
    return readable;
}

Result<void> copy_scans(const Reader& damaged, Store& fresh, const KnownTest& known) {
    const std::size_t channels = known.record.channels.size();
    for (std::int64_t first = 0; first < known.before_scan; first += scans_a_transaction) {
        const std::int64_t last = std::min(first + scans_a_transaction, known.before_scan) - 1;
        std::vector<ScanRecord> scans;
        for (std::int64_t scan = first; scan <= last; ++scan) scans.push_back(missed_scan(known, scan));
        for (ScanRecord& read : readable_scans(damaged, known.id, first, last)) {
            const bool whole = read.samples.size() == channels;
            if (whole) scans[static_cast<std::size_t>(read.scan - first)] = std::move(read);
        }
        if (auto stored = fresh.append_scans(known.id, scans); !stored) return stored;
    }
    return {};
}

Result<void> copy_verdicts(const Reader& damaged, Store& fresh, const KnownTest& known) {
    if (const auto declarations = damaged.declarations(known.id)) {
        for (const DeclarationRecord& declaration : *declarations) {
            if (auto stored = fresh.record_declaration(known.id, declaration); !stored) return stored;
            if (declaration.withdrawn.empty()) continue;
            if (auto stored =
                    fresh.withdraw_declaration(known.id, declaration.channel, declaration.withdrawn);
                !stored) {
                return stored;
            }
        }
    }
    if (const auto identifications = damaged.latest_identifications(known.id)) {
        if (auto stored = fresh.record_identifications(known.id, *identifications); !stored) return stored;
    }
    return {};
}

Result<void> copy_events(const Reader& damaged, Store& fresh, TestId id) {
    const auto events = damaged.events(id, 0, INT64_MAX);
    if (!events) return {};
    for (const EventRecord& event : *events) {
        if (auto stored = fresh.record_event(event); !stored) return std::unexpected(stored.error());
    }
    return {};
}

/// What earlier tests taught, without the tests.
Result<void> copy_archive(const Reader& damaged, Store& fresh) {
    const auto archive = damaged.archive("");
    if (!archive) return {};
    for (ArchiveRecord alone : std::views::reverse(*archive)) {
        alone.test_id.reset();
        if (auto stored = fresh.record_archive(alone); !stored) return std::unexpected(stored.error());
    }
    return {};
}

}  // namespace

Result<void> salvage(const Reader& damaged, Store& fresh, const KnownTest& known, Moment now) {
    if (auto copied = copy_archive(damaged, fresh); !copied) return copied;
    if (known.id == 0) return {};
    if (const auto begun = fresh.begin_test(known.record, known.id); !begun)
        return std::unexpected(begun.error());
    if (auto copied = copy_scans(damaged, fresh, known); !copied) return copied;
    if (auto copied = copy_verdicts(damaged, fresh, known); !copied) return copied;
    if (auto copied = copy_events(damaged, fresh, known.id); !copied) return copied;
    if (known.state == TestState::running) return {};
    return fresh.set_state(known.id, known.state, now, known.reason);
}

}  // namespace thermbal
