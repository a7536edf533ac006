#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "acquisition/line_reader.hpp"
#include "config/config.hpp"
#include "modbus/link.hpp"
#include "modbus/unit.hpp"
#include "statistics.hpp"

namespace thermbal {

/// What health tells of a line. A copy, taken at its last scan.
struct LineHealth {
    std::string name;
    LinkCounters counters;
    struct Unit {
        std::string name;
        bool answering = false;
        std::string last_error;
        double round_trip_ms = 0.0;      ///< of the last scan
        std::uint64_t failures = 0;      ///< scans without a trustworthy answer
        RoundTripHistogram round_trips;  ///< of the scans that were answered
        LinkCounters errors;             ///< what of the line's counters this unit's scans added
        std::string wrong_types;         ///< what the type codes contradict; empty: nothing
    };
    std::vector<Unit> units;
};

/// A line of the configuration on a real link: one block read a unit, registers decoded by the unit's
/// profile.
class ModbusLine final : public Line {
  public:
    using Log = std::function<void(const std::string& message, bool is_trouble)>;

    /// `line` is an index into config.lines. `log` is called on the line's thread when a unit falls silent or
    /// answers again, not for every failure.
    ModbusLine(const Config& config, std::size_t line, std::function<std::int64_t()> real_ns, Log log);

    std::vector<ChannelSample> read_scan() override;
    Result<void> write(const RegisterWrite& write) override;

    LineHealth health() const;  ///< any thread

  private:
    struct ConfiguredChannel {
        std::size_t channel;
        std::size_t input;  // 0-based
        Calibration calibration;
    };
    struct ConfiguredUnit {
        UnitPlan plan;
        std::vector<ConfiguredChannel> channels;
        /// Read back when the unit (re)appears, and while they are wrong: who sets the module right need not
        /// restart us.
        enum class Types : std::uint8_t { unknown, right, wrong, unreadable };
        Types types = Types::unknown;
        int unanswered_type_reads = 0;
        std::vector<bool> input_is_wrong = {};

        bool trusts(std::size_t input) const {
            const bool is_known = !plan.profile.type_code || types != Types::unknown;
            return is_known && !input_is_wrong[input];
        }
    };

    void check_types(std::size_t unit, const UnitReading& reading);
    void note(std::size_t unit, const UnitReading& reading, const LinkCounters& before);

    std::unique_ptr<Link> link_;
    std::vector<ConfiguredUnit> units_;
    const std::function<std::int64_t()> real_ns_;
    const Log log_;
    mutable std::mutex mutex_;
    LineHealth health_;  // guarded by mutex_
};

}  // namespace thermbal
