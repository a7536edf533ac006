#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "simulator/deliveries.hpp"
#include "simulator/faults.hpp"
#include "simulator/frames.hpp"
#include "simulator/module.hpp"
#include "simulator/sim_clock.hpp"

namespace thermbal {

/// What the module measures: a plant, or a recording.
struct ScanSource {
    /// All channels at a simulated time, C; NaN for a channel without a value. Times never go back.
    std::function<std::vector<double>(double time_s)> read_C;
    /// Coil 0 of the first unit was written.
    std::function<void(double time_s, bool run)> run_spindle = [](double, bool) {};
};

enum class ForeignUnit : std::uint8_t { exception_11, silence };

/// What was sent to a read of registers: the truth that a stored scan is checked against.
struct AnsweredRead {
    double time_s = 0.0;
    std::uint8_t unit = 0;
    std::uint8_t function = 0;
    std::uint16_t address = 0;
    std::string fault;  ///< what then happened on the line, or "frozen"; empty for a clean reply
    std::vector<std::uint16_t> words;
};

struct StationListeners {
    std::function<void(const AnsweredRead&)> on_read = [](const AnsweredRead&) {};
    std::function<void(double time_s, std::uint8_t unit, const ModuleWrite&)> on_write =
        [](double, std::uint8_t, const ModuleWrite&) {};
};

/// A module on a line: takes requests, gives what goes back over the wire. One thread.
class Station {
  public:
    Station(ModbusModule module, ScanSource source, FaultPlan plan, SimClock clock, ForeignUnit foreign_unit,
            StationListeners listeners, std::uint64_t noise_seed = 1);

    std::vector<Delivery> serve(Framing framing, const ModbusRequest& request, std::int64_t now_ns);

    /// What is wrong with the socket or port itself.
    EndpointState endpoint(std::int64_t now_ns) const { return plan_.endpoint(next_s(now_ns)); }
    FaultPlan& plan() { return plan_; }
    const FaultPlan& plan() const { return plan_; }
    double next_s(std::int64_t now_ns) const { return clock_.next_s(now_ns); }

  private:
    std::vector<Delivery> serve_foreign(Framing framing, const ModbusRequest& request);
    void report(const ModbusRequest& request, const ModuleReply& reply, const std::string& fault,
                double time_s);
    ModuleInputs inputs_at(double time_s);
    /// What a unit measures: now, or while it is frozen what it measured last.
    const ModuleInputs& measured(std::uint8_t unit, double time_s);

    ModbusModule module_;
    ScanSource source_;
    FaultPlan plan_;
    SimClock clock_;
    ForeignUnit foreign_unit_;
    StationListeners listeners_;
    std::mt19937_64 random_;
    std::map<std::uint8_t, ModuleInputs> measured_;  ///< by unit, at its last read
};

}  // namespace thermbal
