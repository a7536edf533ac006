#include "regression/svr.hpp"

#include <cmath>
#include <numeric>

#include <gtest/gtest.h>

#include "../filter/python_peer.hpp"
#include "regression/grid_search.hpp"
#include "regression/kernel.hpp"
#include "regression/libsvm_solver.hpp"
#include "windows.hpp"

namespace thermbal {
namespace {

using testing::Numbers;

struct Case {
    Numbers window_C;
    std::size_t lags;
    SvrParameters parameters;
};

std::vector<Case> cases() {
    std::vector<Case> all;
    for (const auto* plant : {&testing::one_constant, &testing::two_constants, &testing::three_constants}) {
        for (const std::size_t samples : {100U, 192U, 480U}) {
            const auto window = testing::filtered_warm_up(*plant, samples, samples);
            for (const std::size_t lags : {1U, 4U, 17U, 35U}) {
                for (const double C : {0.25, 16.0, 256.0}) {
                    for (const double sigma : {0.5, 4.0, 32.0})
                        all.push_back({window, lags, {C, sigma, 0.001, 1e-6}});
                }
            }
        }
    }
    return all;
}

std::string request(const Case& one) {
    const auto& p = one.parameters;
    return "fit" + testing::to_words({p.C, p.sigma, p.epsilon, p.tolerance, static_cast<double>(one.lags)}) +
           testing::to_words(one.window_C) + "\n";
}

TEST(Svr, ObjectiveAndPredictionsAreThoseOfScikitLearn) {
    const auto all = cases();
    std::string requests;
    for (const Case& one : all) requests += request(one);
    const auto answers = testing::ask_python("regression/svr_peer.py", requests);
    ASSERT_EQ(answers.size(), all.size());
    for (std::size_t k = 0; k < all.size(); ++k) {
        const Case& one = all[k];
        SCOPED_TRACE("case " + std::to_string(k) + ": n " + std::to_string(one.lags) + " C " +
                     std::to_string(one.parameters.C) + " sigma " + std::to_string(one.parameters.sigma));
        const auto problem = *make_lag_problem(one.window_C, one.lags, 0.0);
        const auto kernel = gaussian_kernel(squared_distances(problem), one.parameters.sigma);
        std::vector<std::size_t> rows(problem.rows());
        std::iota(rows.begin(), rows.end(), std::size_t{0});
        const auto fit = LibsvmSolver(kernel).fit(rows, problem.targets(), one.parameters);
        ASSERT_TRUE(fit);
        const double objective = dual_objective(
            *fit, problem.targets(), one.parameters.epsilon, [&](std::size_t i, std::size_t j) {
                return kernel(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
            });
        const Numbers& answer = answers[k];
        ASSERT_EQ(answer.size(), problem.rows() + 2);
        EXPECT_NEAR(objective, answer[0], 1e-5 * std::abs(answer[0]));
        const SvrModel model(problem, *fit, one.parameters.sigma);
        for (std::size_t row = 0; row < problem.rows(); ++row) {
            ASSERT_NEAR(model.predict_unit(problem.input(row)), answer[row + 2], 1e-4) << row;
        }
    }
}

TEST(Svr, ASubsetOfRowsIsFittedAsIfItWereAlone) {
    const auto window = testing::filtered_warm_up(testing::two_constants, 120, 1);
    const auto problem = *make_lag_problem(window, 3, 0.0);
    const auto kernel = gaussian_kernel(squared_distances(problem), 4.0);
    const SvrParameters parameters{16.0, 4.0, 0.001, 1e-4};
    std::vector<std::size_t> rows;
    for (std::size_t row = 5; row < problem.rows(); row += 2) rows.push_back(row);
    const auto subset = LibsvmSolver(kernel).fit(rows, problem.targets(), parameters);

    std::vector<Eigen::Index> indices(rows.begin(), rows.end());
    const Eigen::MatrixXd alone_kernel = kernel(indices, indices);
    Numbers alone_targets;
    std::vector<std::size_t> alone_rows;
    for (const std::size_t row : rows) {
        alone_rows.push_back(alone_targets.size());
        alone_targets.push_back(problem.target(row));
    }
    const auto alone = LibsvmSolver(alone_kernel).fit(alone_rows, alone_targets, parameters);
    ASSERT_TRUE(subset && alone);
    EXPECT_EQ(subset->coefficient, alone->coefficient);
    EXPECT_EQ(subset->bias, alone->bias);
}

TEST(GridSearch, ErrorsAreThoseOfGridSearchCV) {
    SweepOptions options;
    options.C_grid = {0.25, 4.0, 256.0};
    options.sigma_grid = {0.5, 4.0, 32.0};
    options.solver_tolerance = 1e-5;
    options.solver = SvrSolver::libsvm;
    for (const std::size_t lags : {1U, 8U, 30U}) {
        for (const std::size_t samples : {97U, 192U}) {
            const auto window = testing::filtered_warm_up(testing::two_constants, samples, lags);
            std::string request = "grid" + testing::to_words({options.epsilon, options.solver_tolerance, 5.0,
                                                              static_cast<double>(lags)});
            request += " 0.25,4.0,256.0 0.5,4.0,32.0" + testing::to_words(window) + "\n";
            const auto answer = testing::ask_python("regression/svr_peer.py", request);
            const auto errors =
                cross_validate_grid(*make_lag_problem(window, lags, 0.0), options, never_cancelled);
            ASSERT_TRUE(errors);
            ASSERT_EQ(answer.size(), 1u);
            ASSERT_EQ(answer[0].size(), errors->size());
            for (std::size_t k = 0; k < errors->size(); ++k) {
                EXPECT_NEAR(std::sqrt((*errors)[k]), std::sqrt(answer[0][k]), 1e-5) << "grid point " << k;
            }
        }
    }
}

}  // namespace
}  // namespace thermbal
