#pragma once

#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <stop_token>
#include <thread>
#include <vector>

#include "acquisition/clock.hpp"
#include "acquisition/grid.hpp"
#include "acquisition/mailbox.hpp"
#include "acquisition/scan.hpp"
#include "base/error.hpp"

namespace thermbal {

/// One Modbus line with all its units, as the grid sees it. Used by one thread. Every call has a bound in
/// time that is shorter than the period (the configuration is refused otherwise).
class Line {
  public:
    virtual ~Line() = default;

    /// Reads every unit once. Never fails as a whole: what could not be read comes back marked.
    virtual std::vector<ChannelSample> read_scan() = 0;

    /// Writes a coil (0 or 1) or a holding register, e.g. to stop the spindle.
    virtual Result<void> write(const struct RegisterWrite& write) = 0;
};

struct RegisterWrite {
    int unit_id = 1;
    bool coil = true;
    std::uint16_t address = 0;
    std::uint16_t value = 0;
};

/// The thread of one line: sleeps until the next scan of its grid is due, reads, and mails the reading. A
/// scan that the thread comes too late for is skipped, never squeezed in.
class LineReader {
  public:
    /// `line`, `clock` and `mailbox` outlive the reader.
    LineReader(std::size_t index, Line& line, Clock& clock, Mailbox<LineScan>& mailbox);
    ~LineReader();

    /// Reads on this grid from scan `first_scan` on, instead of on the one before. Any thread.
    void follow(Grid grid, std::uint64_t generation, std::int64_t first_scan);

    /// Writes on the line's thread, between two reads, and hands the outcome to `done` on that thread. Any
    /// thread.
    void write(RegisterWrite write, std::function<void(Result<void>)> done);

  private:
    struct Plan {
        Grid grid;
        std::uint64_t generation = 0;
        std::int64_t next_scan = 0;
    };
    struct PendingWrite {
        RegisterWrite write;
        std::function<void(Result<void>)> done;
    };

    void run(const std::stop_token& stop);
    void carry_out_writes();

    const std::size_t index_;
    Line& line_;
    Clock& clock_;
    Mailbox<LineScan>& mailbox_;
    std::mutex mutex_;
    std::condition_variable_any changed_;
    std::optional<Plan> plan_;          // guarded by mutex_
    std::vector<PendingWrite> writes_;  // guarded by mutex_
    std::jthread thread_;               // last: it uses all of the above
};

}  // namespace thermbal
