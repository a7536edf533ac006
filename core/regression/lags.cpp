#include "regression/lags.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace thermbal {

Result<LagProblem> make_lag_problem(std::span<const double> temperature_C, std::size_t lags,
                                    double smallest_range_C) {
    if (lags == 0) return fail(NextStep::refuse_input, "0 lags: at least 1 is needed");
    if (temperature_C.size() <= lags) {
        return fail(NextStep::refuse_input,
                    fmt::format("{} samples for {} lags: more samples than lags are needed",
                                temperature_C.size(), lags));
    }
    const auto bad = std::ranges::find_if(temperature_C, [](double value) { return !std::isfinite(value); });
    if (bad != temperature_C.end()) {
        return fail(NextStep::refuse_input,
                    fmt::format("sample {} of the window is not a number; fill short gaps first",
                                bad - temperature_C.begin()));
    }
    const auto [lowest, highest] = std::ranges::minmax(temperature_C);
    LagProblem problem;
    problem.scale = {lowest, highest - lowest};
    problem.lags = lags;
    if (!(problem.scale.range_C > smallest_range_C)) {
        return fail(NextStep::refuse_input, fmt::format("the window is flat: its range of {:.3g} C is not "
                                                        "above {:.3g} C, there is no course to learn",
                                                        problem.scale.range_C, smallest_range_C));
    }
    problem.unit.reserve(temperature_C.size());
    for (const double value : temperature_C) problem.unit.push_back(problem.scale.to_unit(value));
    return problem;
}

}  // namespace thermbal
