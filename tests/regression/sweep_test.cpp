#include "regression/sweep.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <thread>

#include <gtest/gtest.h>

#include "windows.hpp"

namespace thermbal {
namespace {

/// A small grid, so that the libsvm path is quick.
SweepOptions quick() {
    SweepOptions options;
    options.solver = SvrSolver::libsvm;
    options.last_lag = 6;
    options.C_grid = {1.0, 64.0};
    options.sigma_grid = {4.0, 32.0};
    return options;
}

void in_reverse_on_three_threads(std::size_t count, const std::function<void(std::size_t)>& body) {
    std::atomic<std::size_t> taken{0};
    std::vector<std::thread> threads;
    threads.reserve(3);
    for (int k = 0; k < 3; ++k) {
        threads.emplace_back([&] {
            for (std::size_t i = taken++; i < count; i = taken++) body(count - 1 - i);
        });
    }
    for (auto& thread : threads) thread.join();
}

bool same_bits(const LagFit& a, const LagFit& b) {
    const auto same = [](double x, double y) { return x == y || (std::isnan(x) && std::isnan(y)); };
    return a.n == b.n && a.C == b.C && a.sigma == b.sigma && same(a.cv_rmse_C, b.cv_rmse_C) &&
           same(a.window_rmse_C, b.window_rmse_C) && same(a.steady_state_C, b.steady_state_C) &&
           a.settles == b.settles && a.leaves_range == b.leaves_range && a.settled_after == b.settled_after &&
           a.support_vectors == b.support_vectors;
}

TEST(Sweep, GivesTheSameBitsInWhateverOrderItIsRun) {
    const auto window = testing::filtered_warm_up(testing::two_constants, 150, 3);
    const auto once = sweep(window, quick(), sequential_for);
    const auto again = sweep(window, quick(), in_reverse_on_three_threads);
    ASSERT_TRUE(once && again);
    ASSERT_EQ(once->by_lag.size(), 6u);
    for (std::size_t k = 0; k < 6; ++k) {
        EXPECT_EQ(once->by_lag[k].n, k + 1);
        EXPECT_TRUE(same_bits(once->by_lag[k], again->by_lag[k])) << k;
    }
}

TEST(Sweep, PredictGivesTheSweepsOwnModel) {
    const auto window = testing::filtered_warm_up(testing::one_constant, 200, 4);
    const auto swept = sweep(window, quick(), sequential_for);
    ASSERT_TRUE(swept);
    const LagFit& chosen = swept->by_lag[3];
    const auto prediction = predict(window, chosen.n, chosen.C, chosen.sigma, 3000, quick());
    ASSERT_TRUE(prediction);
    LagFit same = prediction->fit;
    same.cv_rmse_C = chosen.cv_rmse_C;
    EXPECT_TRUE(same_bits(same, chosen));
    ASSERT_EQ(prediction->window_C.size(), window.size());
    ASSERT_EQ(prediction->predicted_C.size(), 3000u);
    EXPECT_EQ(prediction->window_C[3], window[3]);
    double sum = 0.0;
    for (std::size_t k = chosen.n; k < window.size(); ++k)
        sum += std::pow(prediction->window_C[k] - window[k], 2);
    const double samples = static_cast<double>(window.size() - chosen.n);
    EXPECT_NEAR(std::sqrt(sum / (samples - 1.0)), chosen.window_rmse_C, 1e-12);
    ASSERT_TRUE(chosen.settles);
    ASSERT_LT(chosen.settled_after, 3000u);
    EXPECT_NEAR(prediction->predicted_C[chosen.settled_after], chosen.steady_state_C, 0.005);
    EXPECT_NEAR(prediction->predicted_C.back(), chosen.steady_state_C, 0.005);
}

TEST(Sweep, ALinearAutoregressionSettlesWhereItsEquationSays) {
    // T(k) = a T(k-1) + c from 18 C: T(k) = T_end - (T_end - 18) a^k, T_end = c / (1 - a).
    for (const double steady_state_C : {22.0, 26.7, 40.0}) {
        const double a = 0.95;
        const double rise_C = steady_state_C - 18.0;
        const auto analytic_C = [&](std::size_t k) { return steady_state_C - rise_C * std::pow(a, k); };
        std::vector<double> window(40);
        for (std::size_t k = 0; k < window.size(); ++k) window[k] = analytic_C(k);  // 86 % of the way
        SweepOptions options;
        options.epsilon = 1e-5;
        options.solver = SvrSolver::libsvm;
        options.solver_tolerance = 1e-6;
        const auto prediction = predict(window, 1, 4096.0, 32.0, 600, options);
        ASSERT_TRUE(prediction);
        EXPECT_LT(prediction->fit.window_rmse_C, 0.002 * rise_C);
        ASSERT_TRUE(prediction->fit.settles);
        EXPECT_NEAR(prediction->fit.steady_state_C, steady_state_C, 0.01 * rise_C);
        ASSERT_EQ(prediction->predicted_C.size(), 600u);
        for (std::size_t k = 0; k < 600; k += 50) {
            EXPECT_NEAR(prediction->predicted_C[k], analytic_C(window.size() + k), 0.01 * rise_C) << k;
        }
    }
}

TEST(Sweep, ARunThatDoesNotSettleOrLeavesTheRangeIsFlagged) {
    std::vector<double> ramp(200);
    for (std::size_t k = 0; k < ramp.size(); ++k) ramp[k] = 18.0 + 0.01 * static_cast<double>(k);
    SweepOptions options;
    options.free_run.longest_run = 300;
    const auto unsettled = predict(ramp, 3, 1024.0, 32.0, 100, options);
    ASSERT_TRUE(unsettled);
    EXPECT_FALSE(unsettled->fit.settles);
    EXPECT_TRUE(std::isnan(unsettled->fit.steady_state_C));
    options.free_run.highest_C = 20.5;
    const auto beyond = predict(ramp, 3, 1024.0, 32.0, 300, options);
    ASSERT_TRUE(beyond);
    EXPECT_TRUE(beyond->fit.leaves_range);
    EXPECT_FALSE(beyond->fit.settles);
    EXPECT_LT(beyond->predicted_C.size(), 300u);
    for (const double value : beyond->predicted_C) EXPECT_LE(value, 20.5);
}

TEST(Sweep, RefusesWhatItCannotIdentify) {
    const auto window = testing::filtered_warm_up(testing::one_constant, 100, 5);
    auto gap = window;
    gap[40] = NAN;
    EXPECT_EQ(sweep(gap, quick(), sequential_for).error().next, NextStep::refuse_input);
    EXPECT_NE(sweep(std::vector<double>(100, 21.0), quick(), sequential_for).error().message.find("flat"),
              std::string::npos);
    EXPECT_FALSE(sweep(std::vector<double>{}, quick(), sequential_for));
    EXPECT_FALSE(sweep(std::span(window).first(15), quick(), sequential_for));
    EXPECT_TRUE(sweep(std::span(window).first(fewest_samples(quick())), quick(), sequential_for));
    SweepOptions options = quick();
    options.C_grid = {1.0, 1.0};
    EXPECT_NE(sweep(window, options, sequential_for).error().message.find("C_grid[1] = 1"),
              std::string::npos);
    EXPECT_FALSE(predict(window, 0, 1.0, 1.0, 10, quick()));
    EXPECT_FALSE(predict(window, 2, -1.0, 1.0, 10, quick()));
    EXPECT_FALSE(predict(window, 95, 1.0, 1.0, 10, quick()));
}

TEST(Sweep, StopsSoonWhenCancelled) {
    const auto window = testing::filtered_warm_up(testing::one_constant, 100, 6);
    std::atomic<int> asked{0};
    const auto cancelled = sweep(window, quick(), sequential_for, [&] { return ++asked > 3; });
    ASSERT_FALSE(cancelled);
    EXPECT_EQ(cancelled.error().next, NextStep::stop);
    EXPECT_NE(cancelled.error().message.find("cancelled"), std::string::npos);
    EXPECT_LT(asked, 20);
}

}  // namespace
}  // namespace thermbal
