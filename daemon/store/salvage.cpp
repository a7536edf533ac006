#include "salvage.hpp"

#include <algorithm>
#include <cmath>
#include <ranges>
#include <span>
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

/// A damaged page may still be read, and say what cannot be: a scan of another time would make the new
/// database refuse all that come after it.
bool is_credible(const ScanRecord& read, const KnownTest& known, std::int64_t first, std::int64_t last) {
    if (read.scan < first || read.scan > last) return false;
    const double off_s = std::abs(read.time_s - missed_scan(known, read.scan).time_s);
    return off_s < known.record.period_s / 2.0 && read.samples.size() == known.record.channels.size();
}

template <typename Stored>
bool is_refused(const Result<Stored>& stored) {
    return !stored && stored.error().next == NextStep::refuse_input;
}

/// What the new one refuses was as little a record as what cannot be read.
template <typename Stored>
Result<void> unless_refused(const Result<Stored>& stored) {
    if (stored || is_refused(stored)) return {};
    return std::unexpected(stored.error());
}

Result<void> append_one_by_one(Store& fresh, const KnownTest& known, const std::vector<ScanRecord>& scans) {
    for (const ScanRecord& scan : scans) {
        auto stored = fresh.append_scan(known.id, scan);
        if (is_refused(stored)) stored = fresh.append_scan(known.id, missed_scan(known, scan.scan));
        if (!stored) return stored;
    }
    return {};
}

Result<void> copy_scans(const Reader& damaged, Store& fresh, const KnownTest& known) {
    for (std::int64_t first = 0; first < known.before_scan; first += scans_a_transaction) {
        const std::int64_t last = std::min(first + scans_a_transaction, known.before_scan) - 1;
        std::vector<ScanRecord> scans;
        for (std::int64_t scan = first; scan <= last; ++scan) scans.push_back(missed_scan(known, scan));
        for (ScanRecord& read : readable_scans(damaged, known.id, first, last)) {
            if (is_credible(read, known, first, last))
                scans[static_cast<std::size_t>(read.scan - first)] = std::move(read);
        }
        auto stored = fresh.append_scans(known.id, scans);
        if (is_refused(stored)) stored = append_one_by_one(fresh, known, scans);
        if (!stored) return stored;
    }
    return {};
}

Result<void> copy_declaration(Store& fresh, TestId id, const DeclarationRecord& declaration) {
    if (auto stored = fresh.record_declaration(id, declaration); !stored) return unless_refused(stored);
    if (declaration.withdrawn.empty()) return {};
    return fresh.withdraw_declaration(id, declaration.channel, declaration.withdrawn);
}

Result<void> copy_verdicts(const Reader& damaged, Store& fresh, TestId id) {
    if (const auto declarations = damaged.declarations(id)) {
        for (const DeclarationRecord& declaration : *declarations) {
            if (auto copied = copy_declaration(fresh, id, declaration); !copied) return copied;
        }
    }
    if (const auto identifications = damaged.latest_identifications(id)) {
        for (const IdentificationRecord& identification : *identifications) {
            auto stored = unless_refused(fresh.record_identifications(id, std::span(&identification, 1)));
            if (!stored) return stored;
        }
    }
    return {};
}

Result<void> copy_events(const Reader& damaged, Store& fresh, TestId id) {
    const auto events = damaged.events(id, 0, INT64_MAX);
    if (!events) return {};
    for (const EventRecord& event : *events) {
        if (auto copied = unless_refused(fresh.record_event(event)); !copied) return copied;
    }
    return {};
}

/// What earlier tests taught, without the tests.
Result<void> copy_archive(const Reader& damaged, Store& fresh) {
    const auto archive = damaged.archive("");
    if (!archive) return {};
    for (ArchiveRecord alone : std::views::reverse(*archive)) {
        alone.test_id.reset();
        if (auto copied = unless_refused(fresh.record_archive(alone)); !copied) return copied;
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
    if (auto copied = copy_verdicts(damaged, fresh, known.id); !copied) return copied;
    if (auto copied = copy_events(damaged, fresh, known.id); !copied) return copied;
    if (known.state == TestState::running) return {};
    return fresh.set_state(known.id, known.state, now, known.reason);
}

}  // namespace thermbal
