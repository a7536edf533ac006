#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/error.hpp"
#include "store/records.hpp"
#include "store/store.hpp"

namespace thermbal {

struct StoreQueueLimits {
    std::size_t scans = 10'000;  ///< 41 h of scans every 15 s; about 1 KiB each with 16 channels
    std::size_t others = 10'000;
};

/// Something about the storage that a person should know: said once, not at every attempt.
struct StorageNews {
    enum class Kind : std::uint8_t { away, back, refused, set_aside };
    Kind kind = Kind::away;
    std::string message;
};

/// Writes to a Store in order, and keeps in memory what it does not take at the moment: a full disk, an I/O
/// error, a read-only remount, another program that locks or alters it. Nothing overtakes what waits. One
/// thread; no call waits for longer than the store's busy timeout.
class StoreQueue {
  public:
    using Write = std::function<Result<void>(Store&)>;

    explicit StoreQueue(Store store, StoreQueueLimits limits = {});

    /// A missed scan holds nothing that could be lost: it is written with what comes next, or by flush().
    void append_scan(TestId id, ScanRecord scan);
    /// A write of any kind. With a key, it takes the place of one that waits with the same key: of what is
    /// only of interest in its newest state, an outage keeps only that.
    void write(Write write, std::string_view key = {});
    /// Store::set_state, of a test that is `from` with all that was given before.
    void set_state(TestId id, TestState from, TestState to, Moment now, std::string reason);

    /// The database turned out to be damaged: goes on in a new one with what can still be read of the test
    /// (Store::begin_anew), as it was before the oldest write that waits here, and with what waits. `known`
    /// is the test with all that was given. True when that was done; else it is to be tried again later.
    bool begin_anew(KnownTest known, Moment now);
    /// The database said of itself that it is damaged, or note_damage did: begin_anew is due until it
    /// succeeds.
    bool damaged() const { return damaged_; }
    /// A look through the file found what no write has met yet.
    void note_damage() { damaged_ = true; }

    /// Tries to write what waits. After a failure the rest waits for the next call: call it once a scan.
    void flush();

    std::vector<StorageNews> take_news();

    std::size_t unstored_scans() const { return scans_; }
    std::size_t unstored_writes() const { return waiting_.size(); }  ///< scans and all else
    /// Scans that did not fit into the memory; each is stored as a missed one.
    std::uint64_t lost_scans() const { return lost_scans_; }
    /// Writes that the database contradicts. They are kept and tried again.
    std::size_t refused_writes() const { return refused_.size(); }
    /// Why something waits; empty when nothing does.
    const std::string& problem() const { return problem_; }
    const StoreQueueLimits& limits() const { return limits_; }

    const Store& store() const { return store_; }
    /// For what cannot wait, such as the id of a new test.
    Store& store() { return store_; }

  private:
    struct Entry {
        std::optional<ScanRecord> scan;  ///< or a write
        TestId test = 0;
        Write write;
        std::string key;
        std::optional<TestState> state_before;  ///< of a write that changes the test's state

        bool holds_samples() const { return scan && scan->status != ScanStatus::missed; }
    };

    void add(Entry entry);
    void count(const Entry& entry, int by);
    void give_up_oldest_scan();
    void give_up_oldest_write();
    std::size_t scans_at_front(std::size_t most) const;
    Result<void> write_front(std::size_t scans);
    Result<void> apply(const Entry& entry);
    void put_aside_front(const Error& error);
    void retry_refused();
    void note_failure(const Error& error);
    void note_success();

    Store store_;
    StoreQueueLimits limits_;
    std::deque<Entry> waiting_;
    std::deque<Entry> refused_;
    std::size_t scans_ = 0;       // with samples, in waiting_
    std::size_t others_ = 0;      // no scans, in waiting_
    std::size_t late_scans_ = 0;  // written since the outage began
    std::uint64_t lost_scans_ = 0;
    std::uint64_t flushes_ = 0;
    bool away_ = false;
    bool damaged_ = false;
    std::string problem_;
    std::vector<StorageNews> news_;
};

}  // namespace thermbal
