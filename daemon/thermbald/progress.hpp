#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace thermbal {

/// Whether the daemon does its work: every line delivers the scans of its grid (a scan in which no module
/// answered counts: the line's thread came back in time), and the store answers (a refusal counts: the scans
/// wait in memory, which a restart would throw away). Times are CLOCK_MONOTONIC, in ns: while the host
/// sleeps nobody stands still. One thread.
class Progress {
  public:
    Progress(std::vector<std::string> line_names, std::int64_t limit_ns, std::int64_t now_ns);

    void line_delivered(std::size_t line, std::int64_t now_ns);
    void store_answered(std::int64_t now_ns);

    /// What has stood still for longer than the limit, for the log; empty while all make progress.
    std::optional<std::string> standstill(std::int64_t now_ns) const;

  private:
    struct Part {
        std::string name;
        std::int64_t latest_ns;
    };

    std::vector<Part> parts_;  ///< the store, then the lines
    std::int64_t limit_ns_;
};

}  // namespace thermbal
