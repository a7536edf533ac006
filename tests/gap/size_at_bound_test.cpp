#include "size_at_bound.hpp"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "small_machine.hpp"

namespace thermbal {
namespace {

double mean_of_draws_above(double bound, double mean, double sigma) {
    std::mt19937 random(1);
    std::normal_distribution<double> draw(mean, sigma);
    double sum = 0.0;
    for (int kept = 0; kept < 20000;) {
        const double one = draw(random);
        if (one < bound) continue;
        sum += one;
        ++kept;
    }
    return sum / 20000;
}

TEST(MeanAbove, IsTheMeanOfTheDrawsThatAreLeft) {
    for (const double mean : {-2.0, -0.5, 0.0, 1.0, 4.0})
        EXPECT_NEAR(mean_above(0.0, mean, 1.0), mean_of_draws_above(0.0, mean, 1.0), 0.025) << mean;
    EXPECT_NEAR(mean_above(3.0, 3.0, 2.0), mean_of_draws_above(3.0, 3.0, 2.0), 0.05);
}

TEST(MeanAbove, GoesOnFarBeyondTheBound) {
    EXPECT_NEAR(mean_above(0.0, -7.999, 1.0), mean_above(0.0, -8.001, 1.0), 0.001);
    EXPECT_GT(mean_above(0.0, -1e6, 1.0), 0.0);
}

/// A run of the small machine with this effect, for the machine without it.
Evidence evidence_of(const Effect& effect) {
    Model truth = small_machine();
    truth.effects.push_back(effect);
    Evidence evidence;
    evidence.prior_model = small_machine();
    evidence.run = make_fit_data(small_machine(), measured_on(truth, 300.0, 0.05, 3), {}).value();
    evidence.parallel_for = sequential_for;
    return evidence;
}

Effect preload(double growth_per_K) {
    return {"preload_growth", "", "bearing", {{"growth_per_K", growth_per_K, 0.0}}, {}};
}

/// Friction that falls as it warms is the opposite of friction that grows: a fit of that stops at none.
TEST(ExpectedSize, IsMoreThanNoneWhereTheFitStoppedAtNone) {
    const Evidence evidence =
        evidence_of({"friction_viscosity", "", "bearing", {{"beta_per_K", 0.01, 0.0}}, {}});
    const auto fitted = explain(evidence, {preload(0.03)}, nullptr);
    ASSERT_TRUE(fitted.has_value());
    ASSERT_EQ(fitted->fit.model.effects[0].parameter("growth_per_K"), 0.0);
    const auto expected = with_expected_sizes(evidence, *fitted);
    ASSERT_TRUE(expected.has_value());
    EXPECT_GT(expected->fit.model.effects[0].parameter("growth_per_K"), 0.0);
    EXPECT_LT(expected->fit.point.chi2, fitted->fit.point.chi2 + 6.0);
}

/// Just above its bound a size is as little known as at it.
TEST(ExpectedSize, IsMoreThanTheLikeliestNearTheBound) {
    const Evidence evidence = evidence_of(preload(0.0005));
    const auto fitted = explain(evidence, {preload(0.03)}, nullptr);
    ASSERT_TRUE(fitted.has_value());
    const double likeliest = fitted->fit.model.effects[0].parameter("growth_per_K");
    ASSERT_GT(likeliest, 0.0);
    const auto expected = with_expected_sizes(evidence, *fitted);
    ASSERT_TRUE(expected.has_value());
    EXPECT_GT(expected->fit.model.effects[0].parameter("growth_per_K"), 1.2 * likeliest);
    EXPECT_LT(expected->fit.point.chi2, fitted->fit.point.chi2 + 2.0);
}

TEST(ExpectedSize, IsTheFittedOneElsewhere) {
    const Evidence evidence = evidence_of(preload(0.05));
    const auto fitted = explain(evidence, {preload(0.03)}, nullptr);
    ASSERT_TRUE(fitted.has_value());
    const auto expected = with_expected_sizes(evidence, *fitted);
    ASSERT_TRUE(expected.has_value());
    EXPECT_EQ(expected->fit.model.effects[0].parameter("growth_per_K"),
              fitted->fit.model.effects[0].parameter("growth_per_K"));
}

}  // namespace
}  // namespace thermbal
