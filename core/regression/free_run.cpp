#include "regression/free_run.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

namespace thermbal {
namespace {

/// False for NaN.
bool within(double value, double lowest, double highest) {
    return value >= lowest && value <= highest;
}

/// The newest lags() values, kept contiguous.
class History {
  public:
    explicit History(std::span<const double> start)
        : values_(start.begin(), start.end()), lags_(start.size()) {}

    std::span<const double> newest() const { return std::span(values_).last(lags_); }
    void push(double value) { values_.push_back(value); }

  private:
    std::vector<double> values_;
    std::size_t lags_;
};

/// What a run still has to go, from its moves over the last two spans, taken as a geometric series; NaN when
/// they do not shrink.
double remaining_C(double earlier_move_C, double last_move_C) {
    if (last_move_C == 0.0) return 0.0;
    const double ratio = last_move_C / earlier_move_C;
    if (!(std::abs(ratio) < 1.0)) return std::numeric_limits<double>::quiet_NaN();
    return last_move_C * ratio / (1.0 - ratio);
}

bool spread_below(std::span<const double> values, double limit) {
    const auto [lowest, highest] = std::ranges::minmax(values);
    return highest - lowest < limit;
}

bool has_settled(const std::vector<double>& run, const FreeRunOptions& options, double& steady_state_C) {
    const std::size_t span = options.settle_span;
    if (run.size() <= 2 * span) return false;
    const std::span<const double> recent = std::span(run).last(span + 1);
    if (!spread_below(recent, options.settle_C)) return false;
    const double now = run.back();
    const double before = run[run.size() - 1 - span];
    const double remaining = remaining_C(before - run[run.size() - 1 - 2 * span], now - before);
    if (!(std::abs(remaining) < options.settle_C)) return false;
    steady_state_C = now + remaining;
    return true;
}

template <typename Done>
FreeRun run(const SvrModel& model, const UnitScale& scale, std::span<const double> start_unit,
            std::size_t steps, const FreeRunOptions& options, const Done& done) {
    FreeRun result;
    result.steady_state_C = std::numeric_limits<double>::quiet_NaN();
    History history(start_unit);
    while (result.temperature_C.size() < steps) {
        const double unit = model.predict_unit(history.newest());
        const double value_C = scale.to_C(unit);
        if (!within(value_C, options.lowest_C, options.highest_C)) {
            result.leaves_range = true;
            return result;
        }
        history.push(unit);
        result.temperature_C.push_back(value_C);
        if (done(result)) return result;
    }
    return result;
}

}  // namespace

Result<void> FreeRunOptions::check() const {
    if (settle_span < 2 || settle_span > 1000) {
        return fail(NextStep::refuse_input,
                    fmt::format("settle_span = {}: must be 2 to 1000 samples", settle_span));
    }
    if (longest_run <= 2 * settle_span || longest_run > 1000000) {
        return fail(
            NextStep::refuse_input,
            fmt::format("longest_run = {}: must be above twice settle_span and at most 1000000 samples",
                        longest_run));
    }
    if (!within(settle_C, 1e-9, 1.0)) {
        return fail(NextStep::refuse_input, fmt::format("settle_C = {}: must be 1e-9 to 1", settle_C));
    }
    if (!(lowest_C < highest_C)) {
        return fail(NextStep::refuse_input,
                    fmt::format("lowest_C = {} must be below highest_C = {}", lowest_C, highest_C));
    }
    return {};
}

FreeRun run_freely(const SvrModel& model, const UnitScale& scale, std::span<const double> start_unit,
                   std::size_t steps, const FreeRunOptions& options) {
    return run(model, scale, start_unit, steps, options, [](const FreeRun&) { return false; });
}

FreeRun run_until_settled(const SvrModel& model, const UnitScale& scale, std::span<const double> start_unit,
                          const FreeRunOptions& options) {
    return run(model, scale, start_unit, options.longest_run, options, [&](FreeRun& so_far) {
        so_far.settles = has_settled(so_far.temperature_C, options, so_far.steady_state_C);
        if (so_far.settles) so_far.settled_after = so_far.temperature_C.size();
        return so_far.settles;
    });
}

double root_mean_square_error_C(std::span<const double> estimated_C, std::span<const double> observed_C) {
    double sum = 0.0;
    for (std::size_t k = 0; k < estimated_C.size(); ++k) {
        sum += (estimated_C[k] - observed_C[k]) * (estimated_C[k] - observed_C[k]);
    }
    return std::sqrt(sum / (static_cast<double>(estimated_C.size()) - 1.0));
}

}  // namespace thermbal
