#include "whitening.hpp"

#include <cmath>
#include <limits>
#include <random>

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

namespace thermbal {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

Observation one_channel(const std::vector<double>& reading_C) {
    Observation seen;
    const auto rows = static_cast<Eigen::Index>(reading_C.size());
    seen.channels = {"T1"};
    seen.reading_C.resize(rows, 1);
    seen.sigma_C = Eigen::MatrixXd::Constant(rows, 1, 0.04);
    seen.range_C = Eigen::VectorXd::Constant(1, 10.0);
    for (Eigen::Index k = 0; k < rows; ++k) {
        seen.time_s.push_back(60.0 * static_cast<double>(k));
        seen.reading_C(k, 0) = reading_C[static_cast<std::size_t>(k)];
    }
    return seen;
}

/// The same covariance, written out and factored.
Eigen::MatrixXd dense_covariance(const std::vector<double>& time_s, double noise_C, double wander_C,
                                 double correlation_s) {
    const auto n = static_cast<Eigen::Index>(time_s.size());
    Eigen::MatrixXd covariance(n, n);
    for (Eigen::Index i = 0; i < n; ++i) {
        for (Eigen::Index j = 0; j < n; ++j) {
            const double apart_s =
                std::abs(time_s[static_cast<std::size_t>(i)] - time_s[static_cast<std::size_t>(j)]);
            covariance(i, j) =
                wander_C * wander_C * std::exp(-apart_s / correlation_s) + (i == j ? noise_C * noise_C : 0.0);
        }
    }
    return covariance;
}

TEST(Whitening, IsTheFactorOfTheDenseCovariance) {
    const Observation seen = one_channel(std::vector<double>(60, 20.0));
    const Whitening whitening(seen, {.share_of_rise = 0.005, .correlation_s = 1200.0});
    const Eigen::MatrixXd covariance = dense_covariance(seen.time_s, 0.04, 0.05, 1200.0);
    std::mt19937 random(3);
    std::normal_distribution<double> normal;
    const Eigen::MatrixXd difference = Eigen::MatrixXd::NullaryExpr(60, 1, [&] { return normal(random); });
    const Eigen::LLT<Eigen::MatrixXd> factor(covariance);
    const Eigen::VectorXd expected = factor.matrixL().solve(difference.col(0));
    EXPECT_LT((whitening(difference) - expected).cwiseAbs().maxCoeff(), 1e-9);
    const Eigen::MatrixXd lower = factor.matrixL();
    EXPECT_NEAR(whitening.log_determinant(), 2.0 * lower.diagonal().array().log().sum(), 1e-9);
}

TEST(Whitening, AMissingReadingIsLeftOut) {
    std::vector<double> readings(20, 20.0);
    readings[7] = nan;
    const Observation seen = one_channel(readings);
    const Whitening whitening(seen, {.share_of_rise = 0.005, .correlation_s = 1200.0});
    Eigen::MatrixXd difference = Eigen::MatrixXd::Constant(20, 1, 0.1);
    difference(7, 0) = nan;
    const Eigen::VectorXd white = whitening(difference);
    EXPECT_EQ(white(7), 0.0);
    EXPECT_TRUE(white.allFinite());
    EXPECT_EQ(whitening.readings(), 19);

    std::vector<double> times = seen.time_s;
    times.erase(times.begin() + 7);
    const Eigen::MatrixXd covariance = dense_covariance(times, 0.04, 0.05, 1200.0);
    const Eigen::VectorXd rest = Eigen::VectorXd::Constant(19, 0.1);
    EXPECT_NEAR(white.squaredNorm(), rest.dot(covariance.llt().solve(rest)), 1e-9);
}

TEST(Observation, NoiseIsSeenThroughAWarmUp) {
    std::mt19937 random(5);
    std::normal_distribution<double> noise(0.0, 0.06);
    std::vector<double> readings;
    for (int k = 0; k < 1600; ++k) readings.push_back(30.0 - 10.0 * std::exp(-k / 200.0) + noise(random));
    EXPECT_NEAR(noise_from_differences_C(readings), 0.06, 0.005);
    for (double& reading : readings) reading = std::round(reading * 10.0) / 10.0;
    EXPECT_NEAR(rounding_step_C(readings), 0.1, 1e-9);
}

}  // namespace
}  // namespace thermbal
