#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "network/simulate.hpp"

namespace thermbal {

/// Input columns as the integrator needs them: piecewise constant, with the moments at which they jump.
class InputSchedule {
  public:
    /// `inputs` outlives the schedule.
    InputSchedule(const Inputs& inputs, std::span<const double> sample_times_s);

    double start_s() const { return start_s_; }
    double end_s() const { return end_s_; }

    /// Takes a column into use; empty when the inputs have none of that name with a finite value.
    std::optional<std::size_t> use(std::string_view name);
    /// The moments inside (start, end) at which a column in use jumps, unordered, may repeat.
    std::vector<double> jumps_s() const;
    /// When a node's thermostat was seen to switch; empty when it was not.
    std::vector<double> seen_switchings_s(std::string_view node) const;
    /// Value of a used column between two jumps. Times of consecutive calls for a column must not decrease.
    double at(std::size_t column, double time_s);
    /// Forgets how far `at` has come.
    void rewind();

  private:
    struct Held {
        std::string_view name;
        std::vector<double> from_s;
        std::vector<double> value;
        std::size_t now = 0;
    };
    const Inputs& inputs_;
    double start_s_;
    double end_s_;
    std::vector<Held> used_;
};

}  // namespace thermbal
