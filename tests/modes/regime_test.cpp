#include "modes/regime.hpp"

#include <cmath>

#include <gmock/gmock.h>

#include "lumped_machine.hpp"

namespace thermbal {
namespace {

using testing::Conditions;
using testing::random_machine;
using testing::simulate;

RegimeReport found(const TestWindow& window) {
    return find_regime_changes(window, "T1", RegimeOptions{});
}

TEST(Regime, SmoothWarmUpsHaveNone) {
    for (std::uint64_t seed = 1; seed <= 6; ++seed) {
        testing::LumpedMachine machine = random_machine(seed);
        machine.friction_loss_per_K = seed % 2 == 0 ? 0.015 : 0.0;
        Conditions conditions;
        conditions.ambient_C = [](double minute) {
            return 20.0 + 0.8 * std::sin(minute / 4.0) + 0.005 * minute;
        };
        conditions.noise_seed = seed;
        conditions.log_speed = false;
        const TestWindow whole = simulate(machine, conditions).window;
        for (const double until_min : {30.0, 60.0, 120.0, 200.0}) {
            EXPECT_THAT(found(window_until(whole, 60.0 * until_min)).changes, ::testing::IsEmpty()) << seed;
        }
    }
}

TEST(Regime, LoggedSpeedStepAndStopRestartTheWindow) {
    Conditions conditions;
    conditions.heat_share = [](double minute) { return minute < 60.0 ? 1.0 : minute < 100.0 ? 0.6 : 0.0; };
    const RegimeReport report = found(simulate(random_machine(3), conditions).window);
    ASSERT_GE(report.changes.size(), 2U);
    EXPECT_EQ(report.changes[0].kind, RegimeKind::speed_step);
    EXPECT_DOUBLE_EQ(report.changes[0].time_s, 3600.0);
    EXPECT_EQ(report.changes[1].kind, RegimeKind::spindle_stop);
    EXPECT_GE(report.usable_from_s, 6000.0);
}

TEST(Regime, FindsAStopThatNobodyLogged) {
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
        Conditions conditions;
        conditions.log_speed = false;
        conditions.noise_seed = seed;
        conditions.heat_share = [](double minute) { return minute > 70.0 && minute < 80.0 ? 0.0 : 1.0; };
        const TestWindow whole = simulate(random_machine(seed), conditions).window;
        const RegimeReport early = found(window_until(whole, 60.0 * 78.0));
        ASSERT_FALSE(early.changes.empty()) << seed;
        EXPECT_NEAR(early.changes.front().time_s / 60.0, 70.0, 5.0) << seed;
        EXPECT_GE(found(whole).usable_from_s / 60.0, 78.0) << seed;
    }
}

TEST(Regime, AJumpOfTheRoomIsNamedAndDoesNotRestart) {
    Conditions conditions;
    conditions.ambient_C = [](double minute) { return minute < 90.0 ? 20.0 : 17.5; };
    const RegimeReport report = found(simulate(random_machine(5), conditions).window);
    ASSERT_EQ(report.changes.size(), 1U);
    EXPECT_EQ(report.changes[0].kind, RegimeKind::ambient_jump);
    EXPECT_NEAR(report.changes[0].time_s / 60.0, 90.0, 3.0);
    EXPECT_LT(report.changes[0].size, -1.5);
    EXPECT_DOUBLE_EQ(report.usable_from_s, 0.0);
    EXPECT_GT(report.last_change_s, 0.0);
}

TEST(Regime, OneSensorThatFailsIsNoRegime) {
    TestWindow window = simulate(random_machine(2),
                                 [] {
                                     Conditions conditions;
                                     conditions.log_speed = false;
                                     return conditions;
                                 }())
                            .window;
    for (std::size_t k = 400; k < window.scans; ++k) {
        window.channels[4].values[k] -= 2.0 * (1.0 - std::exp(-0.05 * static_cast<double>(k - 400)));
    }
    EXPECT_THAT(found(window).changes, ::testing::IsEmpty());
}

}  // namespace
}  // namespace thermbal
