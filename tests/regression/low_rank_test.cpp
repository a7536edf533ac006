#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "../filter/python_peer.hpp"
#include "filter/gaps.hpp"
#include "regression/dual_solver.hpp"
#include "regression/grid_search.hpp"
#include "regression/kernel.hpp"
#include "regression/kernel_features.hpp"
#include "regression/newton_system.hpp"
#include "regression/tube_solver.hpp"
#include "regression/vector_loops.hpp"
#include "regression/whole_kernel.hpp"
#include "windows.hpp"

namespace thermbal {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using testing::Numbers;

TEST(VectorLoops, ExpIsThatOfTheStandardLibrary) {
    for (double x = 0.0; x < 690.0; x += 0.0137) {
        double value = x;
        vector_loops::scaled_exp(&value, 1, -1.0);
        ASSERT_NEAR(value / std::exp(-x), 1.0, 4e-16) << x;
    }
}

TEST(VectorLoops, GaussiansAreSummedAsByTheStandardLibrary) {
    std::mt19937_64 random(2);
    std::normal_distribution<double> normal;
    constexpr std::size_t count = 16, lags = 3;
    Numbers centres(count * lags), weights(count), point(lags);
    for (Numbers* values : {&centres, &weights, &point})
        std::ranges::generate(*values, [&] { return normal(random); });
    for (const double factor : {-0.1, -3.0, -1e9}) {
        double sum = 0.0;
        for (std::size_t i = 0; i < count; ++i) {
            double distance = 0.0;
            for (std::size_t l = 0; l < lags; ++l) distance += std::pow(centres[l * count + i] - point[l], 2);
            sum += weights[i] * std::exp(factor * distance);
        }
        EXPECT_NEAR(vector_loops::weighted_gaussians(centres.data(), count, weights.data(), point.data(),
                                                     lags, factor),
                    sum, 1e-14);
    }
}

TEST(VectorLoops, RowsAreMultipliedAndAddedUp) {
    const std::vector<Index> rows{1, 2, 5, 6, 8, 9, 12};
    for (const Index length : {8, 16, 40}) {
        const MatrixXd by_row = MatrixXd::Random(length, 13);
        const MatrixXd chosen = by_row(Eigen::all, rows);
        const VectorXd factor = VectorXd::Random(length);
        VectorXd products(7);
        vector_loops::multiply_rows(by_row.data(), static_cast<std::size_t>(length), rows, factor.data(), 0.5,
                                    products.data());
        EXPECT_LT((products - chosen.transpose() * factor - VectorXd::Constant(7, 0.5)).norm(), 1e-13);
        VectorXd sum = factor;
        const std::vector<double> factors{0.1, -2.0, 0.0, 4.0, 1.0, 3.0, -1.0};
        vector_loops::add_rows(by_row.data(), static_cast<std::size_t>(length), rows, factors, sum.data());
        EXPECT_LT((sum - factor - chosen * Eigen::Map<const VectorXd>(factors.data(), 7)).norm(), 1e-13);
    }
}

TEST(VectorLoops, DerivativesAreThoseOfTheSmoothedLoss) {
    std::mt19937_64 random(1);
    std::normal_distribution<double> normal(0.0, 0.003);
    for (const std::size_t count : {1U, 7U, 8U, 9U, 100U}) {
        Numbers residual(count), change(count);
        for (std::size_t i = 0; i < count; ++i) residual[i] = normal(random), change[i] = normal(random);
        const vector_loops::Tube tube{.C = 3.0, .epsilon = 0.001, .smoothing = 0.002};
        const double t = 0.4;
        double first = 0.0, second = 0.0;
        for (std::size_t i = 0; i < count; ++i) {
            const double moved = residual[i] - t * change[i];
            const double over = (std::abs(moved) - tube.epsilon) / tube.smoothing;
            first += tube.C * std::clamp(over, 0.0, 1.0) * (moved < 0.0 ? -1.0 : 1.0) * change[i];
            if (over > 0.0 && over < 1.0) second += tube.C / tube.smoothing * change[i] * change[i];
        }
        const auto found = vector_loops::derivatives_along(residual.data(), change.data(), t, count, tube);
        EXPECT_NEAR(found.first, first, 1e-13);
        EXPECT_NEAR(found.second, second, 1e-10);
    }
}

/// Of every stride-th row.
MatrixXd kernel_of(const LagProblem& problem, double sigma, std::size_t stride = 1) {
    const auto kept = Eigen::seq(0, Eigen::last, static_cast<Index>(stride));
    return gaussian_kernel(squared_distances(problem), sigma)(kept, kept);
}

TEST(KernelFeatures, MultiplyToTheKernel) {
    const auto window = testing::filtered_warm_up(testing::two_constants, 230, 1);
    for (const std::size_t lags : {1U, 6U, 35U}) {
        const auto problem = *make_lag_problem(window, lags, 0.0);
        for (const double sigma : {0.5, 4.0, 64.0}) {
            for (const std::size_t stride : {1U, 3U}) {
                const auto features = kernel_features(problem, sigma, 1e-9, stride);
                const MatrixXd kernel = kernel_of(problem, sigma, stride);
                const MatrixXd product = features.by_row.transpose() * features.by_row;
                EXPECT_LT((kernel - product).cwiseAbs().maxCoeff(), 1.001e-9);
            }
        }
    }
}

TEST(WholeKernel, IsTheKernelOfTheRowsThatAreKept) {
    const auto window = testing::filtered_warm_up(testing::two_constants, 230, 1);
    for (const std::size_t lags : {1U, 6U, 35U}) {
        const auto problem = *make_lag_problem(window, lags, 0.0);
        for (const double sigma : {0.5, 4.0, 64.0}) {
            for (const std::size_t stride : {1U, 3U}) {
                const WholeKernel whole = whole_kernel(problem, sigma, stride);
                const MatrixXd kernel = kernel_of(problem, sigma, stride);
                const Index count = kernel.rows();
                ASSERT_EQ(whole.by_row.cols(), count);
                EXPECT_LT((kernel - whole.by_row.topRows(count)).cwiseAbs().maxCoeff(), 1e-12);
                EXPECT_EQ(whole.by_row.bottomRows(whole.by_row.rows() - count).cwiseAbs().sum(), 0.0);
            }
        }
    }
}

TEST(KernelFactorisation, KnowsWhetherSoManyFeaturesAreEnough) {
    const auto problem = *make_lag_problem(testing::filtered_warm_up(testing::two_constants, 200, 3), 7, 0.0);
    const std::size_t rank = kernel_features(problem, 2.0, 1e-6).pivots.size();
    for (const bool knows_more : {false, true}) {
        KernelFactorisation factorisation(problem, 2.0);
        if (knows_more) static_cast<void>(factorisation.features(1e-9));
        EXPECT_FALSE(factorisation.is_within(rank - 1, 1e-6));
        EXPECT_TRUE(factorisation.is_within(rank, 1e-6));
        EXPECT_TRUE(factorisation.is_within(problem.rows(), 1e-6));
        EXPECT_EQ(factorisation.features(1e-6).pivots.size(), rank);
    }
}

TEST(KernelFactorisation, GoesOnToWhereItWouldHaveComeAtOnce) {
    const auto problem = *make_lag_problem(testing::filtered_warm_up(testing::two_constants, 200, 3), 7, 0.0);
    KernelFactorisation factorisation(problem, 2.0);
    const auto first = factorisation.features(1e-3);
    const auto further = factorisation.features(1e-8);
    const auto first_again = factorisation.features(1e-3);
    const auto at_once = kernel_features(problem, 2.0, 1e-8);
    EXPECT_LT(first.pivots.size(), further.pivots.size());
    EXPECT_EQ(further.by_row, at_once.by_row);
    EXPECT_EQ(further.pivots, at_once.pivots);
    EXPECT_EQ(first_again.by_row, first.by_row);
    EXPECT_EQ(first.pivots.size(), further.rank_at(1e-3));
}

TEST(KernelFeatures, CarryAFunctionToOtherFeatures) {
    const auto problem = *make_lag_problem(testing::filtered_warm_up(testing::two_constants, 200, 2), 5, 0.0);
    const auto rough = kernel_features(problem, 4.0, 1e-8, 4);
    const auto fine = kernel_features(problem, 4.0, 1e-11, 1);
    const VectorXd weights = VectorXd::LinSpaced(rough.by_row.rows(), -1.0, 1.0);
    const VectorXd carried = weights_of(fine, rough.pivots, pivot_coefficients(rough, weights));
    for (Index k = 0; k < rough.by_row.cols(); ++k) {
        EXPECT_NEAR(rough.by_row.col(k).dot(weights), fine.by_row.col(4 * k).dot(carried), 1e-4);
    }
}

struct Point {
    std::size_t samples, lags;
    double C, sigma;
};

std::vector<Point> points() {
    std::vector<Point> all;
    for (const std::size_t samples : {100U, 192U, 480U}) {
        for (const std::size_t lags : {1U, 4U, 17U, 35U}) {
            for (const double C : {0.25, 16.0, 1024.0}) {
                for (const double sigma : {0.5, 4.0, 32.0}) all.push_back({samples, lags, C, sigma});
            }
        }
    }
    return all;
}

constexpr TubeSolver::Schedule to_the_end{.last_smoothing = 1e-7, .most_steps = 1000};

/// Optimality is proved, not compared: the dual objective of the coefficients on the full kernel matrix in
/// double precision, against the primal objective of the function.
TEST(TubeSolver, TheGapToTheDualObjectiveOnTheFullKernelIsClosed) {
    for (const Point& point : points()) {
        SCOPED_TRACE(std::to_string(point.samples) + " samples, n " + std::to_string(point.lags) + ", C " +
                     std::to_string(point.C) + ", sigma " + std::to_string(point.sigma));
        const auto window = testing::filtered_warm_up(testing::two_constants, point.samples, point.samples);
        const auto problem = *make_lag_problem(window, point.lags, 0.0);
        const auto features = kernel_features(problem, point.sigma, 0.01 * feature_tolerance(point.sigma));
        const VectorXd y =
            Eigen::Map<const VectorXd>(problem.targets().data(), static_cast<Index>(problem.rows()));
        NewtonSystem system(features.by_row);
        std::vector<Index> all(problem.rows());
        std::iota(all.begin(), all.end(), Index{0});
        TubeSolver solver(system, all, y, 0.001);
        ASSERT_TRUE(solver.fit(point.C, solver.cold_start(), to_the_end));
        const VectorXd& c = solver.coefficients();
        EXPECT_LE(c.cwiseAbs().maxCoeff(), point.C);
        EXPECT_NEAR(c.sum(), 0.0, 1e-6 * (1.0 + c.lpNorm<1>()));
        const VectorXd product = kernel_of(problem, point.sigma) * c;
        const double dual = y.dot(c) - 0.001 * c.lpNorm<1>() - 0.5 * c.dot(product);
        const VectorXd residual = y - product - VectorXd::Constant(y.size(), solver.state().bias);
        const double loss = (residual.array().abs() - 0.001).max(0.0).sum();
        const double primal = 0.5 * c.dot(product) + point.C * loss;
        // The mean loss of a row is within a thousandth of epsilon of the smallest there is.
        const double rows = static_cast<double>(y.size());
        EXPECT_LT(primal - dual, 1e-6 * point.C * rows);
        EXPECT_GT(primal - dual, -1e-6 * primal);
    }
}

/// The same proof, on a tenth of the rows held out: their coefficients are 0.
TEST(DualSolver, TheGapToTheDualObjectiveIsClosed) {
    for (const Point& point : points()) {
        SCOPED_TRACE(std::to_string(point.samples) + " samples, n " + std::to_string(point.lags) + ", C " +
                     std::to_string(point.C) + ", sigma " + std::to_string(point.sigma));
        const auto window =
            testing::filtered_warm_up(testing::two_constants, point.samples, point.samples, 1.0);
        const auto problem = *make_lag_problem(window, point.lags, 0.0);
        const WholeKernel whole = whole_kernel(problem, point.sigma);
        const auto rows = static_cast<Index>(problem.rows());
        const Index held_out = rows / 10;
        VectorXd y = VectorXd::Zero(whole.by_row.rows());
        y.head(rows) = Eigen::Map<const VectorXd>(problem.targets().data(), rows);
        VectorXd is_trained = VectorXd::Zero(y.size());
        is_trained.segment(held_out, rows - held_out).setOnes();
        DualSolver::Workspace workspace;
        DualSolver solver(whole, y, is_trained, 0.001, workspace);
        solver.start(point.C, solver.cold_start());
        for (double smoothing = 0.1; smoothing > 0.9e-5; smoothing *= 0.1) {
            // A first time to 0.3 of the smoothing; a step or more each time after that. The race ends there.
            for (int time = 0; time < 20; ++time) ASSERT_TRUE(solver.descend_to(smoothing, 1000));
        }
        const VectorXd c = solver.coefficients().head(rows);
        EXPECT_EQ(c.head(held_out).cwiseAbs().sum(), 0.0);
        EXPECT_LE(c.cwiseAbs().maxCoeff(), point.C);
        EXPECT_NEAR(c.sum(), 0.0, 1e-5 * (1.0 + c.lpNorm<1>()));
        const VectorXd product = kernel_of(problem, point.sigma) * c;
        const double dual = y.head(rows).dot(c) - 0.001 * c.lpNorm<1>() - 0.5 * c.dot(product);
        const VectorXd residual = y.head(rows) - product - VectorXd::Constant(rows, solver.state().bias);
        const VectorXd written = y.head(rows) -
                                 kernel_of(problem, point.sigma) * solver.state().coefficients.head(rows) -
                                 VectorXd::Constant(rows, solver.state().bias);
        EXPECT_LT((written - solver.state().residuals.head(rows)).cwiseAbs().maxCoeff(), 1e-7);
        const double loss = (residual.tail(rows - held_out).array().abs() - 0.001).max(0.0).sum();
        const double primal = 0.5 * c.dot(product) + point.C * loss;
        // The mean loss is off by less than the smoothing.
        EXPECT_LT(primal - dual, 1e-5 * point.C * static_cast<double>(rows));
        EXPECT_GT(primal - dual, -1e-6 * primal);
    }
}

TEST(TubeSolver, PredictionsAreThoseOfScikitLearn) {
    const auto all = points();
    std::string requests;
    for (const Point& p : all) {
        requests +=
            "fit" + testing::to_words({p.C, p.sigma, 0.001, 1e-6, static_cast<double>(p.lags)}) +
            testing::to_words(testing::filtered_warm_up(testing::two_constants, p.samples, p.samples)) + "\n";
    }
    const auto answers = testing::ask_python("regression/svr_peer.py", requests);
    ASSERT_EQ(answers.size(), all.size());
    for (std::size_t k = 0; k < all.size(); ++k) {
        const Point& point = all[k];
        SCOPED_TRACE(std::to_string(point.samples) + " samples, n " + std::to_string(point.lags) + ", C " +
                     std::to_string(point.C) + ", sigma " + std::to_string(point.sigma));
        const auto window = testing::filtered_warm_up(testing::two_constants, point.samples, point.samples);
        const auto problem = *make_lag_problem(window, point.lags, 0.0);
        const auto model = fit_model(problem, point.C, point.sigma, SweepOptions{});
        ASSERT_TRUE(model);
        double largest = 0.0;
        for (std::size_t row = 0; row < problem.rows(); ++row) {
            largest =
                std::max(largest, std::abs(model->predict_unit(problem.input(row)) - answers[k][row + 2]));
        }
        // libsvm's own default tolerance; its kernel is in single precision, which C = 1024 makes felt.
        EXPECT_LT(largest, point.C > 100.0 ? 1e-3 : 1e-4);
    }
}

/// One step off by 1e-5 moves a steady state by 0.02 C: libsvm's kernel in single precision is too coarse to
/// compare with. The peer solves the optimality conditions in double precision instead.
TEST(LowRankSweep, SteadyStatesAreThoseOfTheExactOptimum) {
    struct Expected {
        Point point;
        double steady_state_C;
    };
    std::vector<Expected> ours;
    std::string requests;
    for (const Point& point :
         {Point{192, 1, 1024.0, 8.0}, Point{192, 15, 1024.0, 32.0}, Point{192, 35, 1024.0, 32.0},
          Point{300, 8, 64.0, 8.0}, Point{300, 20, 256.0, 16.0}, Point{300, 30, 256.0, 8.0},
          Point{480, 4, 16.0, 4.0}, Point{480, 35, 1024.0, 32.0}}) {
        const auto window = testing::filtered_warm_up(testing::two_constants, point.samples, 21);
        const auto prediction = predict(window, point.lags, point.C, point.sigma, 1, SweepOptions{});
        ASSERT_TRUE(prediction);
        ours.push_back({point, prediction->fit.steady_state_C});
        requests += testing::to_words({point.C, point.sigma, 0.001, static_cast<double>(point.lags)}) +
                    testing::to_words(window) + "\n";
    }
    const auto exact = testing::ask_python("regression/exact_peer.py", requests);
    ASSERT_EQ(exact.size(), ours.size());
    int compared = 0;
    for (std::size_t k = 0; k < ours.size(); ++k) {
        ASSERT_EQ(exact[k].size(), 1u);
        if (std::isnan(exact[k][0])) continue;  // the peer found no active set
        ++compared;
        EXPECT_NEAR(ours[k].steady_state_C, exact[k][0], 0.01)
            << ours[k].point.samples << " samples, n " << ours[k].point.lags;
    }
    EXPECT_GE(compared, 5);
}

/// A window that the literal pipeline finds hard: noise as large as the rise, a filled gap, next to no rise.
std::vector<std::pair<std::string, Numbers>> hard_windows() {
    std::vector<std::pair<std::string, Numbers>> windows;
    windows.emplace_back("plain", testing::filtered_warm_up(testing::one_constant, 150, 1));
    windows.emplace_back("three constants", testing::filtered_warm_up(testing::three_constants, 150, 2));
    windows.emplace_back("noise 0.3 C", testing::filtered_warm_up(testing::two_constants, 150, 3, 0.3));
    Numbers with_gap = testing::warm_up(testing::two_constants, 150);
    for (double& value : with_gap) value = std::round(value * 10.0) / 10.0;
    for (std::size_t k = 60; k < 75; ++k) with_gap[k] = NAN;
    windows.emplace_back("gap", denoise(fill_short_gaps(with_gap, {})->values_C, {})->values_C);
    Numbers nearly_flat = testing::filtered_warm_up(testing::one_constant, 150, 4);
    for (double& value : nearly_flat) value = 20.0 + 0.03 * (value - 18.0);
    windows.emplace_back("nearly flat", nearly_flat);
    return windows;
}

TEST(LowRankSweep, ChoosesAsTheWholeGridByLibsvmDoes) {
    SweepOptions ours;
    SweepOptions reference;
    reference.solver = SvrSolver::libsvm;
    reference.solver_tolerance = 1e-4;
    for (const auto& [name, window] : hard_windows()) {
        for (const std::size_t lags : {1U, 12U}) {
            SCOPED_TRACE(name + ", n " + std::to_string(lags));
            const auto problem = *make_lag_problem(window, lags, 0.0);
            const auto chosen = search_grid(problem, ours, never_cancelled);
            const auto errors = cross_validate_grid(problem, reference, never_cancelled);
            ASSERT_TRUE(chosen && errors);
            const auto sigma = std::ranges::find(ours.sigma_grid, chosen->sigma) - ours.sigma_grid.begin();
            const auto C = std::ranges::find(ours.C_grid, chosen->C) - ours.C_grid.begin();
            const double at_ours = std::sqrt((
                *errors)[static_cast<std::size_t>(sigma) * ours.C_grid.size() + static_cast<std::size_t>(C)]);
            const double lowest = std::sqrt(*std::ranges::min_element(*errors));
            EXPECT_LT(at_ours - lowest, 1e-3);  // libsvm's default tolerance on the [0, 1] scale
            EXPECT_NEAR(std::sqrt(chosen->cv_mse_unit), at_ours, 1e-3 + 0.02 * at_ours);
        }
    }
}

/// Too much for libsvm: C = 1024 on noise alone takes it minutes a fit.
TEST(LowRankSweep, LosesNothingOnNoiseAloneAndOnCycles) {
    const SweepOptions options;
    Numbers cycling = testing::warm_up(testing::two_constants, 120);
    for (std::size_t k = 0; k < cycling.size(); ++k)
        cycling[k] += 0.4 * std::sin(0.157 * static_cast<double>(k));
    for (const Numbers& window : {testing::filtered_warm_up({{0.0, 1.0}}, 120, 5), cycling}) {
        const auto problem = *make_lag_problem(window, 9, 0.0);
        const auto chosen = search_grid(problem, options, never_cancelled);
        const auto errors = cross_validate_grid(problem, options, never_cancelled);
        ASSERT_TRUE(chosen && errors);
        EXPECT_NEAR(std::sqrt(chosen->cv_mse_unit), std::sqrt(*std::ranges::min_element(*errors)), 1e-4);
    }
}

/// 0.5 C at 0.1 C: steps that no filter removes, and all points lie close together.
void expect_choice_of_whole_grid(const std::size_t samples, const std::vector<std::size_t>& lags_tried) {
    SweepOptions options;
    options.sigma_grid = {4.0, 8.0, 32.0};
    auto window = testing::warm_up(testing::two_constants, samples);
    for (std::size_t k = 0; k < window.size(); ++k) {
        const double wobble_C = 0.03 * std::sin(0.41 * static_cast<double>(k));
        window[k] = std::round((18.0 + 0.06 * (window[k] - 18.0) + wobble_C) * 10.0) / 10.0;
    }
    const auto filtered = denoise(window, {})->values_C;
    for (const std::size_t lags : lags_tried) {
        const auto problem = *make_lag_problem(filtered, lags, 0.0);
        const auto chosen = search_grid(problem, options, never_cancelled);
        const auto errors = cross_validate_grid(problem, options, never_cancelled);
        ASSERT_TRUE(chosen && errors);
        const double lowest = std::sqrt(*std::ranges::min_element(*errors));
        EXPECT_GT(lowest, 0.01) << "not the kind of window that is meant";
        EXPECT_NEAR(std::sqrt(chosen->cv_mse_unit), lowest, 2e-3 * lowest) << "n " << lags;
    }
}

TEST(LowRankSweep, ChoosesAsTheWholeGridWhereAChannelHardlyRises) {
    expect_choice_of_whole_grid(192, {2, 9, 14, 24});
}

/// Every second row is left out of the ranking.
TEST(LowRankSweep, ChoosesAsTheWholeGridWhereRowsAreLeftOut) {
    expect_choice_of_whole_grid(840, {2, 11});
}

TEST(LowRankSweep, LeavesNoGridPointThatTheWholeGridWouldChoose) {
    const SweepOptions options;
    for (std::uint64_t seed = 0; seed < 6; ++seed) {
        const auto window =
            testing::filtered_warm_up(seed % 2 == 0 ? testing::two_constants : testing::three_constants,
                                      130 + 30 * seed, seed, 0.02 * static_cast<double>(seed + 1));
        for (const std::size_t lags : {2U, 9U, 30U}) {
            const auto problem = *make_lag_problem(window, lags, 0.0);
            const auto chosen = search_grid(problem, options, never_cancelled);
            const auto errors = cross_validate_grid(problem, options, never_cancelled);
            ASSERT_TRUE(chosen && errors);
            EXPECT_NEAR(std::sqrt(chosen->cv_mse_unit), std::sqrt(*std::ranges::min_element(*errors)), 1e-6)
                << "seed " << seed << " n " << lags;
        }
    }
}

}  // namespace
}  // namespace thermbal
