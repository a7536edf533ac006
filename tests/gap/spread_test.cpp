#include "spread.hpp"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "small_machine.hpp"

namespace thermbal {
namespace {

/// The small machine with every number off by `relative_sigma`, at random.
Model off_by(double relative_sigma, unsigned seed) {
    std::mt19937 random(seed);
    std::normal_distribution<double> draw(0.0, relative_sigma);
    Model model = small_machine();
    for (Node& node : model.nodes) node.heat_capacity_J_per_K.value *= std::exp(draw(random));
    for (ThermalLink& link : model.links) link.conductance_W_per_K.value *= std::exp(draw(random));
    for (Source& source : model.sources) source.power_W.value *= std::exp(draw(random));
    return model;
}

Evidence evidence_of(const RecordedTest& test) {
    const CalibrationOptions options;
    return {small_machine(), make_fit_data(small_machine(), test, options).value(), {}, {}, options,
            sequential_for};
}

/// Geometric mean of what is seen on several machines whose numbers are that far off.
double mean_spread_seen(double relative_sigma) {
    constexpr unsigned machines = 8;
    double sum = 0.0;
    for (unsigned seed = 1; seed <= machines; ++seed) {
        const Evidence evidence = evidence_of(measured_on(off_by(relative_sigma, seed), 300.0, 0.05, seed));
        sum += std::log(spread_seen(evidence, explain(evidence, {}, nullptr)->fit));
    }
    return std::exp(sum / machines);
}

TEST(Spread, IsWhatTheNumbersAreOffBy) {
    // The model states 20 %.
    EXPECT_GT(mean_spread_seen(0.20), 0.75);
    const double half = mean_spread_seen(0.10);
    EXPECT_GT(half, 0.4);
    EXPECT_LT(half, 0.7);
}

TEST(Spread, IsNeverMoreThanTheModelStates) {
    EXPECT_GT(mean_spread_seen(0.5), 0.95);
    EXPECT_LE(mean_spread_seen(0.5), 1.0);
}

TEST(Spread, IsSeenTheSameFromWhereItWasTakenFor) {
    Evidence evidence = evidence_of(measured_on(off_by(0.1, 3), 300.0, 0.05, 3));
    const auto stated = explain(evidence, {}, nullptr);
    const double seen = spread_seen(evidence, stated->fit);
    ASSERT_LT(seen, 1.0);
    take_for_spread(evidence, seen);
    const auto again = polish(evidence, *stated);
    EXPECT_NEAR(spread_seen(evidence, again->fit), seen, 0.1);
    EXPECT_NEAR(evidence.prior_model.nodes[0].heat_capacity_J_per_K.relative_sigma, 0.2 * seen, 1e-12);
}

}  // namespace
}  // namespace thermbal
