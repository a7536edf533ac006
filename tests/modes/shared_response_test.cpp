#include "shared_response.hpp"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace thermbal {
namespace {

constexpr double noise_C = 0.02;

/// Channels that all mix the same two differences by `mixture`, each with its own shapes and scale.
std::vector<RespondingChannel> planted(const Eigen::VectorXd& mixture, std::size_t count, unsigned seed) {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    std::vector<RespondingChannel> channels;
    for (std::size_t i = 0; i < count; ++i) {
        RespondingChannel channel;
        constexpr Eigen::Index rows = 12;
        channel.scale_C = 2.0 + static_cast<double>(i);
        channel.responses = Eigen::MatrixXd::NullaryExpr(rows, 3, [&] { return normal(random); });
        channel.responses.rightCols(2) *= 0.1;
        channel.covariance = noise_C * noise_C * Eigen::MatrixXd::Identity(rows, rows);
        channel.value =
            channel.scale_C * (channel.responses.col(0) + channel.responses.rightCols(2) * mixture) +
            noise_C * Eigen::VectorXd::NullaryExpr(rows, [&] { return normal(random); });
        channels.push_back(std::move(channel));
    }
    return channels;
}

TEST(SharedResponse, FindsTheMixtureThatAllChannelsHaveInCommon) {
    const Eigen::Vector2d mixture(0.7, -0.4);
    const std::vector<MixtureBelief> beliefs = common_mixture(planted(mixture, 10, 1), {1.0, 0.01});
    for (const MixtureBelief& belief : beliefs) {
        for (Eigen::Index j = 0; j < 2; ++j) {
            EXPECT_LT(std::sqrt(belief.covariance(j, j)), 0.05);
            EXPECT_NEAR(belief.mean[j], mixture[j], 4.0 * std::sqrt(belief.covariance(j, j)));
        }
    }
}

TEST(SharedResponse, NoSampleCountsTwice) {
    const std::vector<MixtureBelief> alone =
        common_mixture(planted(Eigen::Vector2d(0.7, -0.4), 1, 2), {1.0, 0.3});
    EXPECT_NEAR(alone[0].mean.norm(), 0.0, 1e-9);
    EXPECT_NEAR(alone[0].covariance(0, 0), 1.0 + 0.09, 1e-9);

    std::vector<RespondingChannel> channels = planted(Eigen::Vector2d(0.7, -0.4), 4, 3);
    channels[2].value = -channels[2].value + 3.0 * channels[2].responses.col(2);
    const std::vector<MixtureBelief> beliefs = common_mixture(channels, {1.0, 0.01});
    EXPECT_NEAR(beliefs[2].mean[0], 0.7, 0.1)
        << "its own contradicting samples do not move what the others say";
    EXPECT_NEAR(beliefs[2].mean[1], -0.4, 0.1);
}

TEST(SharedResponse, WhatIsStillOpenIsSpannedByTheColumns) {
    const Eigen::MatrixXd responses = Eigen::MatrixXd::Random(9, 3);
    MixtureBelief belief{Eigen::Vector2d(0.5, 0.1), Eigen::Matrix2d{{0.04, 0.01}, {0.01, 0.09}}};
    const Eigen::MatrixXd moved = moved_responses(responses, belief);
    const Eigen::MatrixXd differences = responses.rightCols(2);
    EXPECT_TRUE(moved.col(0).isApprox(responses.col(0) + differences * belief.mean));
    EXPECT_TRUE((moved.rightCols(2) * moved.rightCols(2).transpose())
                    .isApprox(differences * belief.covariance * differences.transpose()));
    EXPECT_EQ(moved_responses(responses, {}), responses);
    EXPECT_TRUE(common_mixture({{}, {}}, {})[0].mean.size() == 0);
}

}  // namespace
}  // namespace thermbal
