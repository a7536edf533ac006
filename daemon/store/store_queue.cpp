#include "store/store_queue.hpp"

#include <algorithm>
#include <ranges>
#include <utility>

#include <fmt/format.h>

namespace thermbal {
namespace {

/// One transaction must not grow with the length of an outage.
constexpr std::size_t scans_a_transaction = 200;
constexpr std::uint64_t flushes_between_retries = 20;
constexpr std::size_t most_refused = 1000;

}  // namespace

StoreQueue::StoreQueue(Store store, StoreQueueLimits limits) : store_(std::move(store)), limits_(limits) {}

void StoreQueue::append_scan(TestId id, ScanRecord scan) {
    Entry entry{.scan = std::move(scan), .test = id, .write = {}, .key = {}, .state_before = {}};
    if (entry.holds_samples())
        add(std::move(entry));
    else
        waiting_.push_back(std::move(entry));
}

void StoreQueue::write(Write write, std::string_view key) {
    if (!key.empty()) {
        others_ -= std::erase_if(waiting_, [&](const Entry& entry) { return entry.key == key; });
    }
    add({.scan = {}, .test = 0, .write = std::move(write), .key = std::string(key), .state_before = {}});
}

void StoreQueue::set_state(TestId id, TestState from, TestState to, Moment now, std::string reason) {
    Write change = [id, to, now, reason = std::move(reason)](Store& store) {
        return store.set_state(id, to, now, reason);
    };
    add({.scan = {}, .test = id, .write = std::move(change), .key = {}, .state_before = from});
}

void StoreQueue::count(const Entry& entry, int by) {
    std::size_t& counted = entry.scan ? scans_ : others_;
    if (!entry.scan || entry.holds_samples()) counted += static_cast<std::size_t>(by);
}

void StoreQueue::add(Entry entry) {
    count(entry, 1);
    waiting_.push_back(std::move(entry));
    if (scans_ > limits_.scans) give_up_oldest_scan();
    if (others_ > limits_.others) give_up_oldest_write();
    // While the storage is away, the owner's flush() tries once a scan: not every event waits for a lock.
    if (!away_) flush();
}

/// The row of the grid stays, what it held is gone: a gap says so.
void StoreQueue::give_up_oldest_scan() {
    const auto oldest = std::ranges::find_if(waiting_, &Entry::holds_samples);
    count(*oldest, -1);
    ScanRecord& scan = *oldest->scan;
    scan.status = ScanStatus::missed;
    scan.started_ns.reset();
    scan.finished_ns.reset();
    std::vector<Sample>().swap(scan.samples);
    std::vector<InputValue>().swap(scan.inputs);
    ++lost_scans_;
}

void StoreQueue::give_up_oldest_write() {
    const auto oldest = std::ranges::find_if(waiting_, [](const Entry& entry) { return !entry.scan; });
    count(*oldest, -1);
    waiting_.erase(oldest);
}

std::size_t StoreQueue::scans_at_front(std::size_t most) const {
    std::size_t scans = 0;
    while (scans < most && scans < waiting_.size() && waiting_[scans].scan &&
           waiting_[scans].test == waiting_.front().test) {
        ++scans;
    }
    return scans;
}

Result<void> StoreQueue::write_front(std::size_t scans) {
    if (scans == 0) return waiting_.front().write(store_);
    std::vector<ScanRecord> records;
    records.reserve(scans);
    for (std::size_t i = 0; i < scans; ++i) records.push_back(*waiting_[i].scan);
    return store_.append_scans(waiting_.front().test, records);
}

void StoreQueue::flush() {
    std::size_t most = scans_a_transaction;
    while (!waiting_.empty()) {
        const std::size_t scans = scans_at_front(most);
        const auto written = write_front(scans);
        if (written) {
            late_scans_ += scans;
            for (std::size_t i = 0; i < std::max<std::size_t>(scans, 1); ++i) {
                count(waiting_.front(), -1);
                waiting_.pop_front();
            }
        } else if (written.error().next != NextStep::refuse_input) {
            note_failure(written.error());
            return;
        } else if (scans > 1) {
            most = 1;  // which of them it is
        } else {
            put_aside_front(written.error());
        }
    }
    note_success();
    if (!refused_.empty() && ++flushes_ % flushes_between_retries == 0) retry_refused();
}

Result<void> StoreQueue::apply(const Entry& entry) {
    return entry.scan ? store_.append_scan(entry.test, *entry.scan) : entry.write(store_);
}

void StoreQueue::put_aside_front(const Error& error) {
    Entry& front = waiting_.front();
    count(front, -1);
    news_.push_back(
        {StorageNews::Kind::refused,
         fmt::format(
             "the database contradicts what is to be stored: {}; it is kept in memory and tried again",
             error.message)});
    if (refused_.size() == most_refused) {
        lost_scans_ += refused_.front().scan ? 1U : 0U;
        refused_.pop_front();
    }
    refused_.push_back(std::move(front));
    waiting_.pop_front();
}

void StoreQueue::retry_refused() {
    std::erase_if(refused_, [this](const Entry& entry) { return apply(entry).has_value(); });
}

bool StoreQueue::begin_anew(KnownTest known, Moment now) {
    // What waits is written behind it: an ended test would take none of it.
    for (const Entry& entry : std::views::reverse(waiting_)) {
        if (entry.test != known.id) continue;
        if (entry.scan) known.before_scan = std::min(known.before_scan, entry.scan->scan);
        if (entry.state_before) known.state = *entry.state_before;
    }
    const auto aside = store_.begin_anew(known, now);
    damaged_ = !aside;
    if (!aside) {
        note_failure(aside.error());
        return false;
    }
    news_.push_back(
        {StorageNews::Kind::set_aside,
         fmt::format("the database was damaged; it is kept as {}, and a new one goes on with what "
                     "could be read of the running test: try `sqlite3 FILE .recover` on it",
                     aside->string())});
    flush();
    return true;
}

void StoreQueue::note_failure(const Error& error) {
    problem_ = error.message;
    damaged_ = damaged_ || error.next == NextStep::stop;
    if (std::exchange(away_, true)) return;
    late_scans_ = 0;
    news_.push_back(
        {StorageNews::Kind::away, fmt::format("{}; scans are kept in memory, up to {}, until it takes them",
                                              error.message, limits_.scans)});
}

void StoreQueue::note_success() {
    problem_.clear();
    if (!std::exchange(away_, false)) return;
    news_.push_back({StorageNews::Kind::back,
                     fmt::format("{} scans that were kept in memory are stored now", late_scans_)});
}

std::vector<StorageNews> StoreQueue::take_news() {
    return std::exchange(news_, {});
}

}  // namespace thermbal
