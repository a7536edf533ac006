#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/error.hpp"
#include "simulator/fault_catalogue.hpp"
#include "simulator/register_map.hpp"

namespace thermbal {

/// What goes wrong, where, and from when to when on the simulated clock.
struct Fault {
    FaultKind kind = FaultKind::silence;
    double value = 0.0;                       ///< what FaultEntry::value says
    std::optional<std::size_t> channel = {};  ///< sensor faults: T1 is 0; nothing: every channel
    std::optional<std::uint8_t> unit = {};    ///< faults of a module or reply; nothing: every unit
    double from_s = 0.0;
    double to_s = std::numeric_limits<double>::infinity();

    FaultPlace place() const { return entry_of(kind).place; }
    bool active(double time_s) const { return time_s >= from_s && time_s < to_s; }
};

/// `KIND[=VALUE][:TARGET]`, e.g. `open:T7`, `exception=4:2` (unit 2), `late=0.3`; from 0 s on, for ever.
/// Errors (refuse_input) say what would be accepted.
Result<Fault> parse_fault_kind(std::string_view text);

/// `KIND[=VALUE][:TARGET]@FROM_S[-TO_S]`, e.g. `open:T7@3600`, `exception=4:2@600-900`.
Result<Fault> parse_fault(std::string_view text);

/// As parse_fault accepts it.
std::string to_string(const Fault& fault);

/// What there is for a fault to act on. As made here: everything.
struct FaultReach {
    FaultFraming framing = FaultFraming::any;
    std::vector<std::uint8_t> units = {};  ///< empty: any
    std::size_t channels = 16;
};

/// Errors (refuse_input): the fault would never do anything there.
Result<void> check_reach(const Fault& fault, const FaultReach& reach);

/// What is wrong with the socket or the port itself.
struct EndpointState {
    bool refuses = false;
    bool half_open = false;
    bool unplugged = false;
    std::optional<double> one_client_hold_s;

    bool operator==(const EndpointState&) const = default;
};

/// The faults that are planned. Of several that are active at one place the first one decides.
class FaultPlan {
  public:
    FaultPlan() = default;
    explicit FaultPlan(std::vector<Fault> faults, FaultReach reach = {})
        : faults_(std::move(faults)), reach_(std::move(reach)) {}

    void add(const Fault& fault) { faults_.push_back(fault); }
    void clear() { faults_.clear(); }
    /// Takes all faults of this kind out; how many there were.
    std::size_t clear(FaultKind kind);
    const std::vector<Fault>& faults() const { return faults_; }
    const FaultReach& reach() const { return reach_; }

    SensorState sensor_state(std::size_t channel, double time_s) const;
    bool frozen(std::uint8_t unit, double time_s) const;
    std::optional<Fault> on_reply(std::uint8_t unit, double time_s) const;
    EndpointState endpoint(double time_s) const;
    /// Whether the state of the endpoint may change without anybody doing anything.
    bool watches_endpoint() const;

  private:
    std::vector<Fault> faults_;
    FaultReach reach_;
};

}  // namespace thermbal
