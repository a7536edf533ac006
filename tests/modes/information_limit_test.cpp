#include "modes/information_limit.hpp"

#include <cmath>

#include <Eigen/LU>
#include <gmock/gmock.h>

#include "lumped_machine.hpp"

namespace thermbal {
namespace {

constexpr double rise_C = 8.7;
const double noise_C = std::hypot(0.05, 0.1 / std::sqrt(12.0));

SharedModes one_channel(std::vector<double> tau, std::vector<double> share) {
    for (double& value : share) value *= rise_C;
    return {std::move(tau), {{"T5", 18.0, std::move(share), noise_C}}, 0.0};
}

double bound(const SharedModes& truth, double minutes) {
    return steady_state_bound_C(truth, 15.0, minutes, SharedKnowledge::single_channel).front();
}

/// The bound from the whole Fisher matrix of level, amplitudes and time constants together, inverted.
double bound_of_full_matrix(const std::vector<double>& tau, const std::vector<double>& amplitude,
                            double minutes) {
    const auto modes = static_cast<Eigen::Index>(tau.size());
    const auto samples = static_cast<Eigen::Index>(minutes / 0.25) + 1;
    Eigen::MatrixXd jacobian(samples, 1 + 2 * modes);
    jacobian.col(0).setOnes();
    for (Eigen::Index k = 0; k < samples; ++k) {
        for (Eigen::Index j = 0; j < modes; ++j) {
            const double ratio = 0.25 * static_cast<double>(k) / tau[static_cast<std::size_t>(j)];
            jacobian(k, 1 + j) = 1.0 - std::exp(-ratio);
            jacobian(k, 1 + modes + j) = -amplitude[static_cast<std::size_t>(j)] * ratio * std::exp(-ratio);
        }
    }
    Eigen::VectorXd functional = Eigen::VectorXd::Zero(1 + 2 * modes);
    functional.head(1 + modes).setOnes();
    const Eigen::MatrixXd covariance =
        (jacobian.transpose() * jacobian).fullPivLu().inverse() * noise_C * noise_C;
    return std::sqrt(functional.dot(covariance * functional));
}

TEST(InformationLimit, AgreesWithTheInverseOfTheWholeFisherMatrix) {
    const std::vector<double> tau{4.0, 15.0, 60.0};
    const std::vector<double> amplitude{0.2 * rise_C, 0.3 * rise_C, 0.5 * rise_C};
    const SharedModes truth = one_channel(tau, {0.2, 0.3, 0.5});
    for (const double minutes : {40.0, 60.0, 80.0, 108.0}) {
        EXPECT_NEAR(bound(truth, minutes) / bound_of_full_matrix(tau, amplitude, minutes), 1.0, 1e-4)
            << minutes;
    }
}

// Figures published with the task, one channel, noise 0.05 C and 0.1 C rounding, to their two digits.
struct Published {
    double minutes;
    double one_constant;
    double two_constants;
};

TEST(InformationLimit, AgreesWithPublishedFigures) {
    const SharedModes one = one_channel({42.0}, {1.0});
    const SharedModes two = one_channel({10.0, 48.0}, {0.35, 0.65});
    for (const Published row :
         {Published{30, 0.28, 8.0}, Published{40, 0.14, 2.3}, Published{48, 0.088, 1.06},
          Published{60, 0.052, 0.42}, Published{80, 0.026, 0.135}, Published{108, 0.013, 0.045}}) {
        EXPECT_NEAR(bound(one, row.minutes) / row.one_constant, 1.0, 0.06) << row.minutes;
        EXPECT_NEAR(bound(two, row.minutes) / row.two_constants, 1.0, 0.06) << row.minutes;
    }
}

TEST(InformationLimit, ChannelsThatShareTimeConstantsKnowMoreThanOneAlone) {
    SharedModes truth = one_channel({10.0, 48.0}, {0.35, 0.65});
    truth.channels.push_back({"T6", 18.0, {6.0, 1.0}, noise_C});
    const double alone = steady_state_bound_C(truth, 15.0, 48.0, SharedKnowledge::single_channel).front();
    const double joint = steady_state_bound_C(truth, 15.0, 48.0, SharedKnowledge::joint).front();
    const double known =
        steady_state_bound_C(truth, 15.0, 48.0, SharedKnowledge::joint_with_prior, 0.01).front();
    EXPECT_LT(joint, 0.8 * alone);
    EXPECT_LT(known, 0.5 * joint);
}

TEST(InformationLimit, EarliestTimeIsWhereTheBoundMeetsTheTolerance) {
    const SharedModes truth = one_channel({42.0}, {1.0});
    const double earliest = earliest_possible_min(truth, 15.0, 0.2, 400.0, SharedKnowledge::joint).front();
    EXPECT_LE(1.645 * bound(truth, earliest), 0.2005);
    EXPECT_GT(1.644 * bound(truth, earliest - 1.0), 0.2);
}

TEST(SharedModesFit, FindsTheTimeConstantsOfALinearMachine) {
    TestWindow window;
    window.scans = 1201;
    for (int i = 0; i < 4; ++i) {
        Column column{testing::channel_name(static_cast<std::size_t>(i) + 2), {}};
        for (std::size_t k = 0; k < window.scans; ++k) {
            const double minute = 0.25 * static_cast<double>(k);
            const double dither =
                0.004 * std::sin(12.9898 * static_cast<double>(k * 7 + 3 * static_cast<std::size_t>(i)));
            column.values.push_back(20.0 - (2.0 + i) * std::expm1(-minute / 8.0) -
                                    (6.0 - i) * std::expm1(-minute / 45.0) + dither);
        }
        window.channels.push_back(std::move(column));
    }
    const Result<SharedModes> fit = fit_shared_modes(window, "", 2);
    ASSERT_TRUE(fit.has_value());
    EXPECT_NEAR(fit->time_constant_min[0], 8.0, 0.08);
    EXPECT_NEAR(fit->time_constant_min[1], 45.0, 0.2);
    EXPECT_NEAR(fit->channels[1].amplitude_C[0], 3.0, 0.03);
    EXPECT_NEAR(fit->channels[1].amplitude_C[1], 5.0, 0.03);
}

TEST(SharedModesFit, RefusesAnAmbientThatIsNotThere) {
    const testing::SimulatedTest test = testing::simulate(testing::random_machine(1), {});
    const Result<SharedModes> fit = fit_shared_modes(test.window, "T77", 2);
    ASSERT_FALSE(fit.has_value());
    EXPECT_THAT(fit.error().message, ::testing::HasSubstr("T77"));
}

}  // namespace
}  // namespace thermbal
