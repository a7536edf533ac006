#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "series/sample.hpp"

namespace thermbal {

/// A limit for one channel, or for every one of them.
struct AlarmLimit {
    std::string name;
    std::optional<std::size_t> channel = {};  ///< empty: every channel
    std::optional<double> above_C = {};
    std::optional<double> below_C = {};
    std::optional<double> rate_C_per_min = {};  ///< of the magnitude
    double rate_over_min = 2.0;
    int scans = 2;  ///< good samples in a row beyond the limit
};

struct Alarm {
    std::size_t channel = 0;
    std::string reason;  ///< what was found, which limit, since when: without the channel's name
};

/// Looks at every good sample of a test. A sample that is not good neither raises an alarm nor ends its row:
/// a module that falls silent above the limit has not cooled down. Pure; one thread.
class AlarmWatch {
  public:
    AlarmWatch(std::vector<AlarmLimit> limits, std::size_t channels);

    /// The samples of one scan at time_s (rising), one a channel. The first limit that is passed, or nothing.
    std::optional<Alarm> take(double time_s, std::span<const Sample> samples);

  private:
    struct Reading {
        double time_s;
        double value_C;
    };
    struct Row {
        int beyond = 0;  ///< good samples in a row
    };

    std::optional<std::string> beyond(const AlarmLimit& limit, std::size_t channel, const Reading& now) const;
    std::optional<double> rate_C_per_min(const AlarmLimit& limit, std::size_t channel,
                                         const Reading& now) const;
    void remember(std::size_t channel, const Reading& now);

    std::vector<AlarmLimit> limits_;
    std::vector<std::vector<Row>> rows_;        // by limit, by channel
    std::vector<std::deque<Reading>> history_;  // by channel, as long as the longest rate_over_min
    double history_s_ = 0.0;
};

}  // namespace thermbal
