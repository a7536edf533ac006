#include "regression/lags.hpp"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "regression/folds.hpp"
#include "regression/kernel.hpp"

namespace thermbal {
namespace {

using ::testing::ElementsAre;

TEST(Lags, AreTheValuesBeforeTheTargetOnTheUnitScale) {
    const std::vector<double> temperature_C{18.0, 20.0, 21.0, 24.0, 28.0};
    const auto problem = make_lag_problem(temperature_C, 2, 1e-6);
    ASSERT_TRUE(problem);
    EXPECT_EQ(problem->rows(), 3u);
    EXPECT_THAT(problem->unit, ElementsAre(0.0, 0.2, 0.3, 0.6, 1.0));
    EXPECT_THAT(problem->input(1), ElementsAre(0.2, 0.3));
    EXPECT_EQ(problem->target(1), 0.6);
    EXPECT_THAT(problem->targets(), ElementsAre(0.3, 0.6, 1.0));
    EXPECT_DOUBLE_EQ(problem->scale.to_C(0.6), 24.0);
    EXPECT_DOUBLE_EQ(problem->scale.to_unit(24.0), 0.6);
}

TEST(Lags, RefuseWhatHasNoCourse) {
    const std::vector<double> flat(50, 20.0);
    EXPECT_EQ(make_lag_problem(flat, 3, 1e-6).error().next, NextStep::refuse_input);
    EXPECT_NE(make_lag_problem(flat, 3, 1e-6).error().message.find("flat"), std::string::npos);
    EXPECT_FALSE(make_lag_problem(std::vector<double>{1.0, 2.0}, 2, 0.0));
    EXPECT_FALSE(make_lag_problem(std::vector<double>{1.0, 2.0}, 0, 0.0));
    EXPECT_NE(make_lag_problem(std::vector<double>{1.0, NAN, 2.0}, 1, 0.0).error().message.find("sample 1"),
              std::string::npos);
    EXPECT_FALSE(make_lag_problem(std::vector<double>{1.0, INFINITY, 2.0}, 1, 0.0));
}

TEST(Kernel, DistancesAreThoseOfTheRows) {
    const std::vector<double> temperature_C{3.0, 1.0, 4.0, 1.5, 5.0, 9.0, 2.0, 6.0, 5.5};
    for (std::size_t lags = 1; lags <= 6; ++lags) {
        const auto problem = *make_lag_problem(temperature_C, lags, 0.0);
        const auto distances = squared_distances(problem);
        const auto kernel = gaussian_kernel(distances, 1.7);
        for (std::size_t i = 0; i < problem.rows(); ++i) {
            for (std::size_t j = 0; j < problem.rows(); ++j) {
                double expected = 0.0;
                for (std::size_t lag = 0; lag < lags; ++lag) {
                    expected += std::pow(problem.input(i)[lag] - problem.input(j)[lag], 2);
                }
                const auto row = static_cast<Eigen::Index>(i);
                const auto column = static_cast<Eigen::Index>(j);
                EXPECT_NEAR(distances(row, column), expected, 1e-14);
                EXPECT_NEAR(kernel(row, column), std::exp(-expected / (1.7 * 1.7)), 1e-14);
            }
        }
    }
}

TEST(Folds, AreThoseOfKFold) {
    const auto folds = make_folds(7, 3, FoldKind::contiguous, 0);
    ASSERT_EQ(folds.size(), 3u);
    EXPECT_THAT(folds[0].held_out_rows, ElementsAre(0, 1, 2));
    EXPECT_THAT(folds[1].held_out_rows, ElementsAre(3, 4));
    EXPECT_THAT(folds[1].training_rows, ElementsAre(0, 1, 2, 5, 6));
    EXPECT_THAT(folds[2].held_out_rows, ElementsAre(5, 6));
}

TEST(Folds, ShuffledLeaveEveryRowOutOnceAndDependOnTheSeedOnly) {
    const auto folds = make_folds(101, 5, FoldKind::shuffled, 9);
    std::vector<int> left_out(101, 0);
    for (const Fold& fold : folds) {
        EXPECT_EQ(fold.training_rows.size() + fold.held_out_rows.size(), 101u);
        for (const std::size_t row : fold.held_out_rows) ++left_out[row];
    }
    EXPECT_THAT(left_out, ::testing::Each(1));
    EXPECT_EQ(make_folds(101, 5, FoldKind::shuffled, 9)[2].held_out_rows, folds[2].held_out_rows);
    EXPECT_NE(make_folds(101, 5, FoldKind::shuffled, 10)[2].held_out_rows, folds[2].held_out_rows);
}

}  // namespace
}  // namespace thermbal
