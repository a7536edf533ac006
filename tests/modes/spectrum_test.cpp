#include "modes/spectrum.hpp"

#include <cmath>
#include <limits>

#include <gmock/gmock.h>

#include "lumped_machine.hpp"

namespace thermbal {
namespace {

using testing::Conditions;
using testing::random_machine;
using testing::simulate;

constexpr std::uint64_t seed = 7;

SpectrumEstimate estimated(const TestWindow& window, const SpectrumOptions& options = {}) {
    Result<SpectrumEstimate> estimate = estimate_spectrum(window, "T1", std::nullopt, options, seed);
    EXPECT_TRUE(estimate.has_value()) << (estimate ? "" : estimate.error().message);
    return estimate ? *estimate : SpectrumEstimate{};
}

struct Score {
    int channels = 0;
    int held = 0;
    int narrow = 0;
    int wrong = 0;
    double square_of_narrow = 0.0;
};

void add(Score& score, const SpectrumEstimate& estimate, const std::vector<double>& truth) {
    for (std::size_t i = 0; i < estimate.channels.size(); ++i) {
        const ChannelEstimate& channel = estimate.channels[i];
        ++score.channels;
        if (channel.steady_state_low_C <= truth[i] && truth[i] <= channel.steady_state_high_C) ++score.held;
        if (channel.steady_state_high_C - channel.steady_state_low_C > 0.4) continue;
        const double error = channel.steady_state_C - truth[i];
        ++score.narrow;
        score.square_of_narrow += error * error;
        if (std::abs(error) > std::max(0.3, 0.05 * std::abs(channel.rise_C))) ++score.wrong;
    }
}

TEST(Spectrum, IntervalsHoldOnMachinesOfAnotherMaking) {
    Score score;
    for (std::uint64_t machine_seed = 101; machine_seed <= 112; ++machine_seed) {
        testing::LumpedMachine machine = random_machine(machine_seed);
        machine.friction_loss_per_K = machine_seed % 3 == 0 ? 0.015 : 0.0;
        Conditions conditions;
        conditions.noise_seed = machine_seed;
        conditions.noise_C = machine_seed % 2 == 0 ? 0.03 : 0.08;
        conditions.rounding_C = machine_seed % 2 == 0 ? 0.1 : 0.01;
        const TestWindow whole = simulate(machine, conditions).window;
        const std::vector<double> truth = testing::settled_C(machine, 20.0, 1.0);
        for (const double until_min : {50.0, 80.0, 120.0, 180.0}) {
            add(score, estimated(window_until(whole, 60.0 * until_min)), truth);
        }
    }
    const double held = static_cast<double>(score.held) / score.channels;
    EXPECT_GT(held, 0.85);
    EXPECT_GT(score.narrow, score.channels / 4);
    EXPECT_LE(score.wrong, score.narrow / 100);
    EXPECT_LT(std::sqrt(score.square_of_narrow / score.narrow), 0.10);
}

TEST(Spectrum, FollowsARoomThatDriftsAndCycles) {
    Score score;
    for (std::uint64_t machine_seed = 201; machine_seed <= 206; ++machine_seed) {
        const testing::LumpedMachine machine = random_machine(machine_seed);
        Conditions conditions;
        conditions.noise_seed = machine_seed;
        conditions.ambient_C = [](double minute) {
            return 20.0 + 0.01 * minute + 0.6 * std::sin(2.0 * 3.14159 * minute / 22.0);
        };
        const TestWindow window = simulate(machine, conditions).window;
        double tail = 0.0;
        for (int k = 0; k < 60; ++k) tail += conditions.ambient_C(200.0 - 0.25 * k) / 60.0;
        add(score, estimated(window), testing::settled_C(machine, tail, 1.0));
    }
    EXPECT_GE(score.held, static_cast<int>(0.8 * score.channels));
    EXPECT_LE(score.wrong, score.narrow / 100);
}

TEST(Spectrum, EquilibriumTimesAreThoseOfTheMachines) {
    std::vector<double> errors;
    int held = 0;
    for (std::uint64_t machine_seed = 301; machine_seed <= 306; ++machine_seed) {
        const testing::LumpedMachine machine = random_machine(machine_seed);
        Conditions conditions;
        conditions.duration_min = 600.0;
        conditions.noise_seed = machine_seed;
        const testing::SimulatedTest test = simulate(machine, conditions);
        const std::vector<double> truth = testing::settled_C(machine, 20.0, 1.0);
        const SpectrumEstimate estimate = estimated(window_until(test.window, 60.0 * 140.0));
        for (std::size_t i = 0; i < truth.size(); ++i) {
            if (truth[i] < 23.0) continue;
            const auto reached = std::ranges::find_if(
                test.clean_C[i], [&](double value_C) { return value_C >= 20.0 + 0.95 * (truth[i] - 20.0); });
            const double reached_min = 0.25 * static_cast<double>(reached - test.clean_C[i].begin());
            const ChannelEstimate& channel = estimate.channels[i];
            errors.push_back(std::abs(channel.equilibrium_time_min / reached_min - 1.0));
            EXPECT_LE(channel.equilibrium_low_min, channel.equilibrium_time_min);
            EXPECT_GE(channel.equilibrium_high_min, channel.equilibrium_time_min);
            held += channel.equilibrium_low_min <= reached_min && reached_min <= channel.equilibrium_high_min
                        ? 1
                        : 0;
        }
    }
    std::ranges::sort(errors);
    ASSERT_GE(errors.size(), 20U);
    EXPECT_LT(errors[errors.size() / 2], 0.04);
    EXPECT_LT(errors[errors.size() * 9 / 10], 0.10);
    EXPECT_GE(held, static_cast<int>(0.8 * static_cast<double>(errors.size())));
}

TEST(Spectrum, SameWindowSameBits) {
    const TestWindow window = window_until(simulate(random_machine(11), {}).window, 3600.0);
    const SpectrumEstimate first = estimated(window);
    const SpectrumEstimate second = estimated(window);
    for (std::size_t i = 0; i < first.channels.size(); ++i) {
        EXPECT_EQ(first.channels[i].steady_state_C, second.channels[i].steady_state_C);
        EXPECT_EQ(first.channels[i].steady_state_high_C, second.channels[i].steady_state_high_C);
        EXPECT_EQ(first.channels[i].equilibrium_time_min, second.channels[i].equilibrium_time_min);
        EXPECT_EQ(first.channels[i].coefficients, second.channels[i].coefficients);
    }
}

TEST(Spectrum, AnotherSeedMovesTheAnswerLittle) {
    const TestWindow window = window_until(simulate(random_machine(12), {}).window, 60.0 * 110.0);
    const SpectrumEstimate first = estimated(window);
    const Result<SpectrumEstimate> second = estimate_spectrum(window, "T1", std::nullopt, {}, seed + 1);
    ASSERT_TRUE(second.has_value());
    for (std::size_t i = 0; i < first.channels.size(); ++i) {
        EXPECT_NEAR(first.channels[i].steady_state_C, second->channels[i].steady_state_C,
                    0.02 + first.channels[i].steady_state_sd_C);
    }
}

TEST(Spectrum, GapsAndSpikesDoNotMoveTheSteadyState) {
    TestWindow window = window_until(simulate(random_machine(13), {}).window, 60.0 * 140.0);
    const std::vector<double> truth = testing::settled_C(random_machine(13), 20.0, 1.0);
    for (std::size_t k = 200; k < 240; ++k)
        window.channels[3].values[k] = std::numeric_limits<double>::quiet_NaN();
    for (std::size_t k = 50; k < window.scans; k += 61) window.channels[2].values[k] += 15.0;
    for (std::size_t k = 20; k < window.scans; k += 83) window.channels[0].values[k] -= 9.0;
    const SpectrumEstimate estimate = estimated(window);
    for (std::size_t i = 0; i < truth.size(); ++i) {
        EXPECT_NEAR(estimate.channels[i].steady_state_C, truth[i],
                    0.05 + 3.0 * estimate.channels[i].steady_state_sd_C);
        EXPECT_LT(estimate.channels[i].noise_C, 0.2);
    }
}

TEST(Spectrum, StartsAgainAfterASpeedStepWithChannelsOutOfEquilibrium) {
    const testing::LumpedMachine machine = random_machine(14);
    Conditions conditions;
    conditions.heat_share = [](double minute) { return minute < 60.0 ? 1.0 : 0.5; };
    const TestWindow whole = simulate(machine, conditions).window;
    const TestWindow rest = window_from(whole, 3600.0);
    const std::vector<double> start(whole.channels.size(), 20.0);
    const Result<SpectrumEstimate> estimate = estimate_spectrum(rest, "T1", std::nullopt, {}, seed, start);
    ASSERT_TRUE(estimate.has_value());
    const std::vector<double> truth = testing::settled_C(machine, 20.0, 0.5);
    for (std::size_t i = 0; i < truth.size(); ++i) {
        EXPECT_NEAR(estimate->channels[i].steady_state_C, truth[i], 0.3) << i;
        EXPECT_NEAR(estimate->channels[i].rise_C, truth[i] - 20.0, 0.4) << i;
    }
}

TEST(Spectrum, TheCurveRunsThroughTheSamplesAndEndsAtTheSteadyState) {
    const testing::SimulatedTest test = simulate(random_machine(15), {});
    const TestWindow window = window_until(test.window, 60.0 * 100.0);
    const SpectrumEstimate estimate = estimated(window);
    const ChannelEstimate& channel = estimate.channels[3];
    const std::vector<double> curve =
        predict_curve(estimate, channel, window, "T1", {600.0, 3000.0, 6000.0, 9000.0, 1e6});
    EXPECT_NEAR(curve[0], test.clean_C[3][40], 0.05);
    EXPECT_NEAR(curve[1], test.clean_C[3][200], 0.05);
    EXPECT_NEAR(curve[2], test.clean_C[3][400], 0.05);
    EXPECT_NEAR(curve[3], test.clean_C[3][600], 0.15);
    EXPECT_NEAR(curve[4], channel.steady_state_C, 1e-6);
}

TEST(Spectrum, RefusesWhatItCannotUse) {
    const TestWindow window = simulate(random_machine(16), {}).window;
    EXPECT_THAT(estimate_spectrum(window, "T99", std::nullopt, {}, seed).error().message,
                ::testing::HasSubstr("T99"));
    EXPECT_EQ(estimate_spectrum(window_until(window, 120.0), "T1", std::nullopt, {}, seed).error().next,
              NextStep::refuse_input);
    SpectrumOptions options;
    options.expected_modes = -1.0;
    EXPECT_THAT(estimate_spectrum(window, "T1", std::nullopt, options, seed).error().message,
                ::testing::HasSubstr("expected_modes"));
    TestWindow empty = window;
    for (Column& column : empty.channels) column.values.assign(empty.scans, std::nan(""));
    EXPECT_FALSE(estimate_spectrum(empty, "T1", std::nullopt, {}, seed).has_value());
}

TEST(Spectrum, WorksWithoutAnAmbientAndWithADeadChannel) {
    TestWindow window = window_until(simulate(random_machine(17), {}).window, 60.0 * 140.0);
    window.channels[5].values.assign(window.scans, std::nan(""));
    window.channels.erase(window.channels.begin());
    const Result<SpectrumEstimate> estimate = estimate_spectrum(window, "", std::nullopt, {}, seed);
    ASSERT_TRUE(estimate.has_value());
    EXPECT_EQ(estimate->channels.size(), window.channels.size() - 1);
    EXPECT_FALSE(estimate->has_ambient);
}

}  // namespace
}  // namespace thermbal
