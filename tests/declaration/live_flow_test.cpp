#include "declaration/live_flow.hpp"

#include <cmath>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "declaration/declarations.hpp"
#include "series/sample.hpp"

namespace thermbal {
namespace {

bool never() {
    return false;
}

/// Sums of two exponentials with known steady states, room constant, 0.05 C noise, 0.1 C rounding.
TestWindow exponentials(std::size_t scans, const std::vector<double>& rise_C, unsigned seed) {
    std::mt19937 generator(seed);
    std::normal_distribution<double> noise_C(0.0, 0.05);
    const auto reading = [&](double value_C) {
        return std::round((value_C + noise_C(generator)) * 10.0) / 10.0;
    };
    TestWindow window{0.0, 15.0, scans, {{"T1", {}}}, {}};
    for (std::size_t c = 0; c < rise_C.size(); ++c)
        window.channels.push_back({"T" + std::to_string(c + 2), {}});
    for (std::size_t k = 0; k < scans; ++k) {
        const double t_min = 0.25 * static_cast<double>(k);
        window.channels[0].values.push_back(reading(18.0));
        for (std::size_t c = 0; c < rise_C.size(); ++c) {
            const double fast_share = 0.2 + 0.1 * static_cast<double>(c % 5);
            const double rise =
                fast_share * (1 - std::exp(-t_min / 9.0)) + (1 - fast_share) * (1 - std::exp(-t_min / 40.0));
            window.channels[c + 1].values.push_back(reading(18.0 + rise_C[c] * rise));
        }
    }
    return window;
}

FlowOptions quick() {
    FlowOptions options;
    options.sweep.last_lag = 12;
    return options;
}

const std::vector<double> rises_C{9.0, 6.0, 4.0, 12.0, 7.0};

TEST(LiveFlow, WhatItDeclaresIsTrueAndComesBeforeTheEnd) {
    const TestWindow whole = exponentials(1600, rises_C, 3);
    LiveFlow flow(quick());
    Declarations declarations;
    for (double until_min = 20.0;
         until_min <= 200.0 && declarations.declared_channels().size() < rises_C.size(); until_min += 10.0) {
        const auto verdict = flow.identify(window_until(whole, until_min * 60.0),
                                           declarations.declared_channels(), sequential_for, never);
        if (verdict) declarations.update(verdict->channels, verdict->regime_since_min);
    }
    ASSERT_EQ(declarations.standing().size(), rises_C.size());
    for (std::size_t c = 0; c < rises_C.size(); ++c) {
        const ChannelVerdict& verdict = declarations.standing()[c];
        EXPECT_TRUE(verdict.declared()) << verdict.channel << ": " << verdict.reason;
        EXPECT_NEAR(verdict.steady_state_C, 18.0 + rises_C[c], 0.3) << verdict.channel;
        EXPECT_LE(verdict.steady_state_low_C, verdict.steady_state_C);
        EXPECT_GE(verdict.steady_state_high_C, verdict.steady_state_C);
    }
}

TEST(LiveFlow, AVerdictDependsOnTheWindowAndNotOnWhatWasIdentifiedBefore) {
    const TestWindow whole = exponentials(480, rises_C, 4);
    FlowOptions options = quick();
    options.sweep_when = SweepWhen::always;
    LiveFlow grown(options), fresh(options);
    for (double until_min = 40.0; until_min < 100.0; until_min += 20.0) {
        ASSERT_TRUE(grown.identify(window_until(whole, until_min * 60.0), {}, sequential_for, never));
    }
    const TestWindow window = window_until(whole, 100.0 * 60.0);
    const auto one = grown.identify(window, {}, sequential_for, never);
    const auto other = fresh.identify(window, {}, sequential_for, never);
    ASSERT_TRUE(one && other);
    for (std::size_t c = 0; c < rises_C.size(); ++c) {
        EXPECT_EQ(one->channels[c].steady_state_C, other->channels[c].steady_state_C);
        EXPECT_EQ(one->channels[c].rmse_by_n_C, other->channels[c].rmse_by_n_C);
        EXPECT_EQ(one->channels[c].svr.C, other->channels[c].svr.C);
        EXPECT_EQ(one->channels[c].reason, other->channels[c].reason);
    }
}

TEST(LiveFlow, DeadAndStuckChannelsHaveStatesOfTheirOwn) {
    TestWindow window = exponentials(300, rises_C, 5);
    std::ranges::fill(window.channels[2].values, no_value);
    for (std::size_t k = 60; k < 300; ++k) window.channels[3].values[k] = window.channels[3].values[59];
    const auto verdict = LiveFlow(quick()).identify(window, {}, sequential_for, never);
    ASSERT_TRUE(verdict);
    EXPECT_EQ(verdict->channels[1].state, ChannelState::dead);
    EXPECT_EQ(verdict->channels[2].state, ChannelState::stuck) << verdict->channels[2].reason;
    EXPECT_NE(verdict->channels[0].state, ChannelState::stuck);
}

TEST(LiveFlow, ASensorThatFallsSilentIsDeadAndNotStuckAtItsLastReading) {
    TestWindow window = exponentials(300, rises_C, 5);
    for (std::size_t k = 100; k < 300; ++k) window.channels[2].values[k] = no_value;
    const auto verdict = LiveFlow(quick()).identify(window, {}, sequential_for, never);
    ASSERT_TRUE(verdict);
    EXPECT_EQ(verdict->channels[1].state, ChannelState::dead) << verdict->channels[1].reason;
}

TEST(LiveFlow, ASensorWhoseNoiseStopsIsStuckThoughTheMachineRests) {
    constexpr std::size_t scans = 1200;
    constexpr std::size_t since = scans - 80;  // 20 min, more than four time constants after the start
    TestWindow window = exponentials(scans, rises_C, 8);
    std::mt19937 generator(9);
    std::normal_distribution<double> noise_C(0.0, 0.03);
    std::vector<double>& fine = window.channels[3].values;
    for (double& value_C : fine) value_C = std::round((22.0 + noise_C(generator)) * 100.0) / 100.0;
    std::vector<double>& coarse =
        window.channels[4].values;  // noise of a fifth of a step: stands still by itself
    for (double& value_C : coarse) value_C = std::round((29.5 + noise_C(generator) / 1.5) * 10.0) / 10.0;
    const auto state_of = [&](std::size_t channel) {
        return LiveFlow(quick()).identify(window, {}, sequential_for, never)->channels[channel - 1].state;
    };
    EXPECT_NE(state_of(3), ChannelState::stuck);
    std::fill(fine.begin() + since, fine.end(), fine[since - 1]);
    std::fill(coarse.begin() + since, coarse.end(), coarse[since - 1]);
    EXPECT_EQ(state_of(3), ChannelState::stuck);
    EXPECT_NE(state_of(4), ChannelState::stuck);
}

TEST(LiveFlow, TheCriterionBeginsAnewAfterAGapThatIsTooLongToFill) {
    TestWindow window = exponentials(400, rises_C, 7);
    std::vector<double>& samples = window.channels[1].values;
    std::fill(samples.begin() + 100, samples.begin() + 130, no_value);
    TestWindow after = window;
    std::fill_n(after.channels[1].values.begin(), 130, no_value);
    FlowOptions options = quick();
    options.sweep_when = SweepWhen::always;
    const std::set<std::string> others{"T3", "T4", "T5", "T6"};
    const auto verdict = LiveFlow(options).identify(window, others, sequential_for, never);
    const auto expected = LiveFlow(options).identify(after, others, sequential_for, never);
    ASSERT_TRUE(verdict && expected);
    ASSERT_EQ(verdict->channels[0].rmse_by_n_C.size(), options.sweep.last_lag) << verdict->channels[0].reason;
    EXPECT_EQ(verdict->channels[0].rmse_by_n_C, expected->channels[0].rmse_by_n_C);
    EXPECT_TRUE(std::isnan(verdict->channels[0].svr.equilibrium_time_min));
}

TEST(LiveFlow, AWindowThatIsTooLongIsIdentifiedFromItsMeans) {
    const TestWindow whole = exponentials(1600, rises_C, 5);
    FlowOptions options = quick();
    options.longest_window_scans = 600;
    options.longest_sweep_scans = 200;
    options.sweep_when = SweepWhen::always;
    const auto verdict = LiveFlow(options).identify(whole, {}, sequential_for, never);
    ASSERT_TRUE(verdict) << verdict.error().message;
    EXPECT_EQ(verdict->window_end_min, whole.end_s() / 60.0);
    for (std::size_t c = 0; c < rises_C.size(); ++c) {
        const ChannelVerdict& channel = verdict->channels[c];
        EXPECT_NEAR(channel.steady_state_C, 18.0 + rises_C[c], 0.1) << channel.channel;
        EXPECT_NEAR(channel.svr.steady_state_C, 18.0 + rises_C[c], 0.2) << channel.channel;
        EXPECT_EQ(channel.rmse_by_n_C.size(), options.sweep.last_lag);
    }
}

TEST(LiveFlow, SaysWhatIsMissing) {
    const TestWindow window = exponentials(40, rises_C, 6);
    FlowOptions options = quick();
    options.ambient = "T9";
    const auto unknown = LiveFlow(options).identify(window, {}, sequential_for, never);
    ASSERT_FALSE(unknown);
    EXPECT_EQ(unknown.error().next, NextStep::refuse_input);
    EXPECT_THAT(unknown.error().message, testing::HasSubstr("T9"));
    const auto early = LiveFlow(quick()).identify(window, {}, sequential_for, never);
    ASSERT_TRUE(early);
    EXPECT_THAT(early->channels[0].reason, testing::HasSubstr("enough_samples: 9.8 min"));
}

}  // namespace
}  // namespace thermbal
