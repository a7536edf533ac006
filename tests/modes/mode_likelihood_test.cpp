#include "mode_likelihood.hpp"

#include <cmath>
#include <random>

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

namespace thermbal {
namespace {

constexpr Eigen::Index points = 12;
constexpr Eigen::Index rows = 30;

/// A whitened channel as the data it came from.
struct Measured {
    Eigen::MatrixXd columns;
    Eigen::VectorXd data;
    double scale = 1.0;
};

std::vector<Measured> measured_channels(std::size_t count) {
    std::mt19937_64 engine(11);  // NOLINT(*-msc51-cpp): the same channels on every run
    std::normal_distribution<double> normal;
    std::vector<Measured> channels(count);
    for (Measured& channel : channels) {
        channel.columns = Eigen::MatrixXd::NullaryExpr(rows, points, [&] { return normal(engine); });
        channel.data = Eigen::VectorXd::NullaryExpr(rows, [&] { return 3.0 * normal(engine); });
        channel.scale = std::exp(normal(engine));
    }
    return channels;
}

std::vector<WhitenedChannel> whitened(const std::vector<Measured>& channels, double direction) {
    std::vector<WhitenedChannel> all;
    all.reserve(channels.size());
    for (const Measured& channel : channels) {
        all.push_back({channel.columns.transpose() * channel.columns,
                       channel.columns.transpose() * channel.data, channel.scale, direction});
    }
    return all;
}

ModePrior prior_of_signs() {
    ModePrior prior;
    prior.same_sign = Eigen::VectorXd::LinSpaced(points, 0.0, 0.7);
    return prior;
}

/// The logarithm of the density of the data, less that of the data without any mode: the dense normal
/// distribution itself, its covariance written out.
double by_density(const std::vector<Measured>& channels, const std::vector<Mode>& modes, double direction) {
    // Not relative_amplitudes, which the likelihood calls: LinSpaced(0, 0.7) in closed form.
    const auto count = static_cast<Eigen::Index>(modes.size());
    Eigen::VectorXd variance(count);
    Eigen::VectorXd mean(count);
    for (Eigen::Index k = 0; k < count; ++k) {
        const Mode& mode = modes[static_cast<std::size_t>(k)];
        const double share = 0.7 * mode.position / (points - 1) * direction;
        mean[k] = std::exp(0.5 * mode.log_variance) * share;
        variance[k] = std::exp(mode.log_variance) - mean[k] * mean[k];
    }
    double total = 0.0;
    for (const Measured& channel : channels) {
        Eigen::MatrixXd at_modes(rows, static_cast<Eigen::Index>(modes.size()));
        for (std::size_t k = 0; k < modes.size(); ++k) {
            const auto below = static_cast<Eigen::Index>(modes[k].position);
            const double share = modes[k].position - static_cast<double>(below);
            at_modes.col(static_cast<Eigen::Index>(k)) =
                (1.0 - share) * channel.columns.col(below) + share * channel.columns.col(below + 1);
        }
        const Eigen::MatrixXd covariance =
            Eigen::MatrixXd::Identity(rows, rows) +
            channel.scale * channel.scale * at_modes * variance.asDiagonal() * at_modes.transpose();
        const Eigen::VectorXd away = channel.data - channel.scale * at_modes * mean;
        const Eigen::LDLT<Eigen::MatrixXd> factor(covariance);
        total += 0.5 * (channel.data.squaredNorm() - away.dot(factor.solve(away)) -
                        factor.vectorD().array().log().sum());
    }
    return total;
}

void expect_density(std::size_t count, double direction, const std::vector<Mode>& modes) {
    const std::vector<Measured> channels = measured_channels(count);
    const ModePrior prior = prior_of_signs();
    const double expected = by_density(channels, modes, direction);
    const double found = ModeLikelihood(whitened(channels, direction), prior).log_at(modes);
    EXPECT_NEAR(found, expected, 1e-9 * std::max(1.0, std::abs(expected)))
        << count << " channels, direction " << direction << ", " << modes.size() << " modes";
}

TEST(ModeLikelihood, IsTheDensityOfTheDataHoweverManyChannels) {
    const std::vector<Mode> modes = {{2.0, -1.0}, {5.25, 0.5}, {9.5, -3.0}, {11.0, 1.0}};
    for (const std::size_t count : {1UL, 15UL, 16UL, 17UL, 40UL}) {
        for (const double direction : {1.0, -1.0, -0.3, 0.0}) expect_density(count, direction, modes);
    }
}

TEST(ModeLikelihood, IsTheDensityOfTheDataFromNoModeToTheMost) {
    std::vector<Mode> modes;
    while (modes.size() < ModeLikelihood::most_modes) {
        expect_density(15, 1.0, modes);
        const auto next = static_cast<double>(modes.size() % 11);
        modes.push_back({next + 0.25, -0.2 * next});
    }
    expect_density(15, 1.0, modes);
}

// Eleven pivots of 1e40 multiply to more than a double holds. Columns at right angles: the dense
// covariance stays well conditioned.
TEST(ModeLikelihood, AWideRangeOfPivotsOverflowsNothing) {
    std::vector<Measured> channels = measured_channels(3);
    for (Measured& channel : channels) channel.columns = 1e20 * Eigen::MatrixXd::Identity(rows, points);
    std::vector<Mode> modes(points - 1);
    for (std::size_t k = 0; k < modes.size(); ++k) modes[k] = {static_cast<double>(k), 45.0};
    const ModePrior prior = prior_of_signs();
    const double found = ModeLikelihood(whitened(channels, 0.0), prior).log_at(modes);
    const double expected = by_density(channels, modes, 0.0);
    EXPECT_TRUE(std::isfinite(found));
    EXPECT_NEAR(found, expected, 1e-9 * std::abs(expected));
}

}  // namespace
}  // namespace thermbal
