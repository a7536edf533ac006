#include "explanation.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Cholesky>

#include "base/median.hpp"

namespace thermbal {
namespace {

/// The coordinates of a neighbour's fit, then the new effects' own, then the nuisances.
Eigen::VectorXd coordinates_from(const FitProblem& problem, const Eigen::VectorXd& neighbour) {
    Eigen::VectorXd coordinates = problem.prior_coordinates();
    const Eigen::Index nuisances = problem.data().nuisances();
    const auto known = neighbour.size() - nuisances;
    coordinates.head(known) = neighbour.head(known);
    coordinates.tail(nuisances) = neighbour.tail(nuisances);
    return coordinates;
}

/// Before the spindle starts the machine is about as warm everywhere as the spread of all first readings says
/// (Student's t, three degrees of freedom: a warm corner is no miracle). Speaks for an offset that brings its
/// sensor back to the others, and against one that takes it away from them.
double start_consensus(const FitData& data, const Model& model) {
    std::vector<double> first_C, away_C;
    for (const auto& reading : data.seen.inputs.first_readings) first_C.push_back(reading.value_C);
    if (first_C.size() < 4) return 0.0;
    const double middle_C = upper_median(first_C);
    for (const double value_C : first_C) away_C.push_back(std::abs(value_C - middle_C));
    const double spread_C = std::hypot(1.48 * upper_median(away_C), 0.5 * data.seen.scan_sigma_C.mean());
    const auto log_density = [&](double reading_C) {
        const double z = (reading_C - middle_C) / spread_C;
        return -2.0 * std::log1p(z * z / 3.0);
    };
    double gained = 0.0;
    for (const Effect& effect : model.effects) {
        if (effect.kind != "sensor_offset") continue;
        const auto& readings = data.seen.inputs.first_readings;
        const auto own = std::ranges::find(readings, effect.at, &Inputs::FirstReading::channel);
        if (own == readings.end()) continue;
        gained += log_density(own->value_C - effect.parameter("offset_C")) - log_density(own->value_C);
    }
    return gained;
}

double length_s(const FitData& data) {
    return data.seen.time_s.back() - data.seen.time_s.front();
}

Result<Explanation> explained_from(const Evidence& evidence, std::vector<Effect> effects,
                                   const FitProblem& problem, const FitStart& start) {
    auto fit = minimise(problem, start, evidence.calibration, evidence.parallel_for);
    if (!fit) return std::unexpected(fit.error());
    Explanation explanation{std::move(effects), std::move(*fit), 0.0, 0.0};
    explanation.log_evidence = log_evidence(explanation.fit, length_s(evidence.run)) +
                               start_consensus(evidence.run, explanation.fit.model);
    return explanation;
}

}  // namespace

Model with_effects(const Model& model, const std::vector<Effect>& effects) {
    Model extended = model;
    extended.effects.insert(extended.effects.end(), effects.begin(), effects.end());
    return extended;
}

double log_evidence(const Fit& fit, double run_length_s) {
    const Linearisation linearisation(fit);
    double result = -0.5 * fit.point.chi2 - 0.5 * linearisation.log_determinant();
    for (const Parameter& parameter : fit.parameters) {
        if (!parameter.of_effect) continue;
        if (std::isfinite(parameter.prior_sigma)) {
            result -= std::log(parameter.prior_sigma);
            continue;
        }
        const double range = parameter.is_time ? run_length_s : parameter.upper - parameter.lower;
        result += 0.5 * std::log(2.0 * std::numbers::pi) - std::log(range);
    }
    return result;
}

Result<Explanation> explain(const Evidence& evidence, std::vector<Effect> effects,
                            const Explanation* neighbour) {
    const FitProblem problem(evidence.run, with_effects(evidence.prior_model, effects));
    FitStart start{problem.prior_coordinates(), nullptr};
    if (neighbour != nullptr) {
        start.coordinates = coordinates_from(problem, neighbour->fit.point.coordinates);
        start.known_jacobian = &neighbour->fit.jacobian;
    }
    return explained_from(evidence, std::move(effects), problem, start);
}

Result<Explanation> explain_anew(const Evidence& evidence, std::vector<Effect> effects,
                                 const Eigen::VectorXd& coordinates) {
    const FitProblem problem(evidence.run, with_effects(evidence.prior_model, effects));
    const FitStart start{coordinates_from(problem, coordinates), nullptr};
    return explained_from(evidence, std::move(effects), problem, start);
}

Result<Explanation> explain_with_only(const Evidence& evidence, const Explanation& explanation,
                                      const std::vector<std::size_t>& kept) {
    std::vector<Effect> effects;
    effects.reserve(kept.size());
    for (const std::size_t k : kept) effects.push_back(explanation.effects[k]);
    const std::size_t known = evidence.prior_model.effects.size();
    const std::vector<Parameter>& parameters = explanation.fit.parameters;
    const Eigen::VectorXd& coordinates = explanation.fit.point.coordinates;
    std::vector<Eigen::Index> staying;
    const auto take_numbers = [&](auto which) {
        for (std::size_t p = 0; p < parameters.size(); ++p) {
            if (which(parameters[p])) staying.push_back(static_cast<Eigen::Index>(p));
        }
    };
    take_numbers([&](const Parameter& one) { return !one.of_effect || one.effect < known; });
    for (const std::size_t k : kept)
        take_numbers([&](const Parameter& one) { return one.of_effect && one.effect == known + k; });
    for (auto i = static_cast<Eigen::Index>(parameters.size()); i < coordinates.size(); ++i)
        staying.push_back(i);
    const FitProblem problem(evidence.run, with_effects(evidence.prior_model, effects));
    return explained_from(evidence, std::move(effects), problem, {coordinates(staying), nullptr});
}

Result<Simulation> simulate_run(const Evidence& evidence, const Explanation& explanation,
                                const Model& model) {
    const FitProblem problem(evidence.run, with_effects(evidence.prior_model, explanation.effects));
    return simulate(model, problem.inputs_at(explanation.fit.point.coordinates), evidence.run.seen.time_s);
}

Result<Explanation> polish(const Evidence& evidence, const Explanation& explanation) {
    const FitProblem problem(evidence.run, with_effects(evidence.prior_model, explanation.effects));
    return explained_from(evidence, explanation.effects, problem,
                          {explanation.fit.point.coordinates, nullptr});
}

}  // namespace thermbal
