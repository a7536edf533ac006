#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "acquisition/grid.hpp"
#include "series/sample.hpp"
#include "series/test_state.hpp"

namespace thermbal {

struct ChannelSample {
    std::size_t channel = 0;  ///< position in the configuration
    Sample sample;
};

/// What one line read for one scan.
struct LineScan {
    std::size_t line = 0;
    std::uint64_t generation = 0;  ///< of the grid it was read on
    std::int64_t scan = 0;
    std::int64_t started_ns = 0;  ///< monotonic, as finished_ns
    std::int64_t finished_ns = 0;
    std::int64_t wall_ns = 0;  ///< UTC when the read started
    std::vector<ChannelSample> samples;
};

/// One row of the grid, all channels in the order of the configuration.
struct Scan {
    std::int64_t scan = 0;
    ScanStatus status = ScanStatus::missed;
    std::int64_t due_ns = 0;
    std::int64_t started_ns = 0;
    std::int64_t finished_ns = 0;
    std::int64_t wall_ns = 0;
    std::vector<Sample> samples;
};

/// Puts the readings of all lines together into scans, in the order of the grid, every scan exactly once: a
/// scan that no line has read becomes a missed one, a line that is silent when its scan is closed leaves
/// communication samples. Event loop only.
class ScanAssembler {
  public:
    /// channel_line[c] is the line that channel c hangs on.
    ScanAssembler(Grid grid, std::uint64_t generation, std::int64_t first_scan,
                  std::vector<std::size_t> channel_line, std::size_t lines);

    /// Takes a reading. One of another grid, of a scan already closed, or a second one of the same scan is
    /// dropped.
    void add(LineScan reading);

    /// The scans that are complete now, the oldest `most` of them: read by all lines, or with their period
    /// over at now_ns. wall_ns is the wall time at now_ns (missed scans are stamped with the wall time of
    /// their due moment).
    std::vector<Scan> take_closed(std::int64_t now_ns, std::int64_t wall_ns,
                                  std::size_t most = std::numeric_limits<std::size_t>::max());

    /// When the oldest open scan is closed at the latest.
    std::int64_t next_close_ns() const { return grid_.due_ns(next_ + 1); }
    const Grid& grid() const { return grid_; }

  private:
    Scan close(std::int64_t now_ns, std::int64_t wall_ns);

    Grid grid_;
    std::uint64_t generation_;
    std::int64_t next_;
    std::vector<std::size_t> channel_line_;
    std::vector<std::vector<LineScan>> waiting_;  // by line, oldest first
};

}  // namespace thermbal
