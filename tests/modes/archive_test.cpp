#include "modes/archive.hpp"

#include <gmock/gmock.h>

#include "lumped_machine.hpp"

namespace thermbal {
namespace {

constexpr std::uint64_t seed = 3;

TestWindow test_of(std::uint64_t machine_seed, double heat, std::uint64_t noise_seed) {
    testing::LumpedMachine machine = testing::random_machine(machine_seed);
    machine.friction_loss_per_K = 0.01;
    testing::Conditions conditions;
    conditions.duration_min = 400.0;
    conditions.noise_seed = noise_seed;
    conditions.heat_share = [heat](double) { return heat; };
    return testing::simulate(machine, conditions).window;
}

SpectrumPrior prior_of(std::uint64_t machine_seed) {
    std::vector<ArchivedSpectrum> tests;
    for (std::uint64_t k = 0; k < 3; ++k) {
        const TestWindow window = test_of(machine_seed, 0.7 + 0.2 * static_cast<double>(k), 50 + k);
        const Result<SpectrumEstimate> estimate = estimate_spectrum(window, "T1", std::nullopt, {}, seed);
        EXPECT_TRUE(estimate.has_value());
        if (estimate) tests.push_back(archived(*estimate));
    }
    const Result<SpectrumPrior> prior = learn_prior(tests, {}, {});
    EXPECT_TRUE(prior.has_value());
    return prior ? *prior : SpectrumPrior{};
}

TEST(Archive, EarlierTestsMakeTheFourthNarrowEarlyAndStillRight) {
    const SpectrumPrior prior = prior_of(21);
    const TestWindow early = window_until(test_of(21, 1.2, 99), 60.0 * 45.0);
    testing::LumpedMachine machine = testing::random_machine(21);
    machine.friction_loss_per_K = 0.01;
    const std::vector<double> truth = testing::settled_C(machine, 20.0, 1.2);
    const Result<SpectrumEstimate> without = estimate_spectrum(early, "T1", std::nullopt, {}, seed);
    const Result<ArchivedEstimate> with = estimate_with_archive(early, "T1", prior, {}, seed);
    ASSERT_TRUE(without && with);
    EXPECT_FALSE(with->contradiction.contradicted) << with->contradiction.mode_energy;
    int held = 0;
    double ratio = 0.0;
    for (std::size_t i = 0; i < truth.size(); ++i) {
        const ChannelEstimate& channel = with->estimate.channels[i];
        held += channel.steady_state_low_C <= truth[i] && truth[i] <= channel.steady_state_high_C ? 1 : 0;
        ratio += channel.steady_state_sd_C / without->channels[i].steady_state_sd_C /
                 static_cast<double>(truth.size());
    }
    EXPECT_GE(held, 6);
    EXPECT_LT(ratio, 0.6);
}

TEST(Archive, AnotherMachineIsNoticedAndItsPriorDropped) {
    const SpectrumPrior prior = prior_of(21);
    testing::LumpedMachine changed = testing::random_machine(21);
    for (double& capacity : changed.heat_capacity_J_per_K) capacity *= 0.6;
    changed.between_W_per_K[3][4] *= 0.3;
    changed.between_W_per_K[4][3] *= 0.3;
    const TestWindow window = window_until(testing::simulate(changed, {}).window, 60.0 * 70.0);
    const Result<ArchivedEstimate> estimate = estimate_with_archive(window, "T1", prior, {}, seed);
    ASSERT_TRUE(estimate.has_value());
    EXPECT_TRUE(estimate->contradiction.contradicted) << estimate->contradiction.mode_energy;
    EXPECT_THAT(estimate->contradiction.reason, ::testing::HasSubstr("archive is not used"));
    EXPECT_FALSE(estimate->estimate.used_responses());
}

TEST(Archive, RefusesSpectraOfAnotherGrid) {
    ArchivedSpectrum other;
    other.time_constant_min = {1.0, 2.0, 3.0};
    other.mode_density = {0.1, 0.1, 0.1};
    other.mode_log_variance = {0.0, 0.0, 0.0};
    EXPECT_EQ(learn_prior({other}, {}, {}).error().next, NextStep::refuse_input);
    EXPECT_FALSE(learn_prior({}, {}, {}).has_value());
}

}  // namespace
}  // namespace thermbal
