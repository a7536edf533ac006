#include "network/parameters.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "models.hpp"

namespace thermbal::testing {
namespace {

Model with_an_effect() {
    Model model = spindle_head();
    model.effects = {
        {"cutting_heat", "", "sleeve", {{"power_W", 40.0, 4.0}, {"onset_s", 1000.0}}, {}},
        {"sensor_offset", "", "T2", {{"offset_C", 0.4}}, {}},
    };
    return model;
}

const Parameter& named(const std::vector<Parameter>& parameters, const std::string& name) {
    for (const Parameter& parameter : parameters) {
        if (parameter.name == name) return parameter;
    }
    ADD_FAILURE() << "no parameter " << name;
    return parameters.front();
}

TEST(NetworkParameters, AreAllNumbersThatAreNotKnownExactly) {
    Model model = with_an_effect();
    EXPECT_EQ(parameters_of(model).size(), 4U + 6U + 2U + 3U);
    model.nodes[0].heat_capacity_J_per_K.relative_sigma = 0.0;
    model.sources[0].exponent.relative_sigma = 0.1;
    model.ambient.sigma_C = 0.5;
    const auto parameters = parameters_of(model);
    EXPECT_EQ(parameters.size(), 3U + 6U + 3U + 1U + 3U);
    EXPECT_FALSE(named(parameters, "ambient_C").logarithmic);
    EXPECT_EQ(named(parameters, "ambient_C").prior_sigma, 0.5);
}

TEST(NetworkParameters, PriorsAreLogNormalWithTheStatedRelativeSigma) {
    const auto parameters = parameters_of(spindle_head());
    const Parameter& conductance = named(parameters, "bearing-sleeve.conductance_W_per_K");
    EXPECT_EQ(conductance.value, 11.0);
    // Of a log-normal number: relative sigma^2 = exp(sigma^2) - 1.
    EXPECT_NEAR(std::expm1(conductance.prior_sigma * conductance.prior_sigma), 0.09, 1e-12);
    EXPECT_NEAR(conductance.prior_residual(11.0 * std::exp(conductance.prior_sigma)), 1.0, 1e-12);
}

TEST(NetworkParameters, AnEffectKeepsTheSigmaOfItsFitElseTheCataloguesPrior) {
    const auto parameters = parameters_of(with_an_effect());
    const Parameter& power = named(parameters, "cutting_heat(sleeve).power_W");
    EXPECT_TRUE(power.of_effect && power.logarithmic);
    EXPECT_EQ(power.prior_centre, 40.0);
    EXPECT_NEAR(power.prior_sigma, 0.1, 1e-3);
    const Parameter& onset = named(parameters, "cutting_heat(sleeve).onset_s");
    EXPECT_TRUE(onset.is_time);
    EXPECT_EQ(onset.prior_residual(5000.0), 0.0) << "flat";
    EXPECT_EQ(named(parameters, "sensor_offset(T2).offset_C").effect, 1U);
    EXPECT_EQ(named(parameters, "sensor_offset(T2).offset_C").prior_centre, 0.0);
}

TEST(NetworkParameters, ValuesAndSigmasGoBackInTheSameOrder) {
    const Model model = with_an_effect();
    const auto before = parameters_of(model);
    std::vector<double> values;
    std::vector<double> sigmas;
    for (std::size_t i = 0; i < before.size(); ++i) {
        values.push_back(before[i].value * (1.0 + 0.001 * static_cast<double>(i + 1)));
        sigmas.push_back(0.01 * static_cast<double>(i + 1));
    }
    Model changed = model;
    set_parameter_values(changed, values);
    set_parameter_sigmas(changed, sigmas);
    const auto after = parameters_of(changed);
    ASSERT_EQ(after.size(), before.size());
    for (std::size_t i = 0; i < after.size(); ++i) {
        EXPECT_EQ(after[i].name, before[i].name);
        EXPECT_DOUBLE_EQ(after[i].value, values[i]);
        EXPECT_NEAR(after[i].prior_sigma, sigmas[i], 1e-9) << after[i].name;
        EXPECT_EQ(after[i].prior_centre, after[i].value);
    }
}

}  // namespace
}  // namespace thermbal::testing
