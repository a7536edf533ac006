#include <algorithm>
#include <array>
#include <cmath>

#include "heat_response.hpp"
#include "network/simulate.hpp"
#include "pooling.hpp"
#include "thermostats.hpp"
#include "threshold_fit.hpp"

namespace thermbal {
namespace {

using Eigen::Index;

constexpr double nats_that_speak_for_heat = 5.0;
constexpr std::size_t most_nodes = 3;
/// A chiller that is strong enough never lets its node get warmer than where it switches on.
constexpr std::array below_the_warmest = {0.0, 0.004, 0.01, 0.02, 0.04, 0.08, 0.15};  ///< shares of the range
constexpr std::array hysteresis_shares = {0.005, 0.012, 0.03, 0.07, 0.16, 0.35};      ///< of the range

/// What the node's thermostat felt: the mean of the readings on the node, smoothed over three bins; what the
/// model says where nothing is measured.
Eigen::VectorXd felt_C(const Evidence& evidence, const Explanation& current, const std::string& node) {
    const Observation& seen = evidence.run.seen;
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(seen.reading_C.rows());
    int sensors = 0;
    for (std::size_t c = 0; c < seen.columns(); ++c) {
        if (current.fit.model.sensors[seen.sensors[c]].node != node) continue;
        const auto column = static_cast<Index>(c);
        sum += seen.reading_C.col(column).array().isFinite().select(
            seen.reading_C.col(column), current.fit.point.simulated_C.col(column));
        ++sensors;
    }
    if (sensors == 0) return node_course(current.fit.model, seen, node);
    Eigen::VectorXd smoothed = sum / sensors;
    for (Index row = 1; row + 1 < sum.size(); ++row) smoothed(row) = sum.segment(row - 1, 3).mean() / sensors;
    return smoothed;
}

/// When a thermostat with these thresholds would have switched, on first.
std::vector<double> crossings_of(const Eigen::VectorXd& felt_C, const std::vector<double>& time_s,
                                 double on_C, double hysteresis_C) {
    std::vector<double> moments_s;
    for (Index row = 0; row < felt_C.size(); ++row) {
        const bool runs = moments_s.size() % 2 == 1;
        if (runs ? felt_C(row) < on_C - hysteresis_C : felt_C(row) > on_C)
            moments_s.push_back(time_s[static_cast<std::size_t>(row)]);
    }
    return moments_s;
}

/// Of a course that is smooth without it.
double noise_of(const Eigen::VectorXd& felt_C) {
    const double seen_C = noise_from_differences_C({felt_C.begin(), felt_C.end()});
    return std::isfinite(seen_C) ? std::max(seen_C, 1e-3) : 1e-3;
}

/// When the node turned: from warming to cooling, that is where its chiller was switched on, and back, each
/// turn by `least_C` or more. Noise moves these less than the crossing of a threshold that is approached
/// slowly.
std::vector<double> turns_of(const Eigen::VectorXd& felt_C, const std::vector<double>& time_s,
                             double least_C) {
    std::vector<double> turns_s;
    Index furthest = 0;
    for (Index row = 0; row < felt_C.size(); ++row) {
        const double sign = turns_s.size() % 2 == 0 ? 1.0 : -1.0;
        if (sign * (felt_C(row) - felt_C(furthest)) > 0.0) furthest = row;
        if (sign * (felt_C(furthest) - felt_C(row)) < least_C) continue;
        turns_s.push_back(time_s[static_cast<std::size_t>(furthest)]);
        furthest = row;
    }
    return turns_s;
}

/// To 1 W taken away from every odd moment to the next.
Eigen::MatrixXd answer_to_cooling(const CourseOfReadings& answer_to_heat, const std::vector<double>& time_s,
                                  const std::vector<double>& moments_s) {
    Eigen::MatrixXd change_C = Eigen::MatrixXd::Zero(answer_to_heat.rows(), answer_to_heat.columns());
    double sign = -1.0;
    for (const double moment_s : moments_s) {
        const auto first = std::ranges::upper_bound(time_s, moment_s) - time_s.begin();
        for (Index row = first; row < change_C.rows(); ++row)
            change_C.row(row) += sign * answer_to_heat.at(time_s[static_cast<std::size_t>(row)] - moment_s);
        sign = -sign;
    }
    return change_C;
}

/// Searches the thresholds of a thermostat at one node.
class ThermostatSearch {
  public:
    /// All outlive it.
    ThermostatSearch(const FitData& run, const Model& model, const Linearisation& linearisation,
                     const CourseOfReadings& answer_to_heat, const Candidate& candidate)
        : run_(run),
          linearisation_(linearisation),
          answer_to_heat_(answer_to_heat),
          best_{candidate, make_effect(*candidate.definition, *candidate.form, candidate.at, model), 0.0} {}

    Screened over(const Eigen::VectorXd& felt_C) {
        if (felt_C.size() == 0) return best_;
        const double warmest_C = felt_C.maxCoeff(), range_C = warmest_C - felt_C.minCoeff();
        for (const double below : below_the_warmest) {
            for (const double hysteresis : hysteresis_shares)
                look_at(felt_C, warmest_C - below * range_C, hysteresis * range_C);
        }
        for (double turn_C = 5.0 * noise_of(felt_C); turn_C < range_C; turn_C *= 1.5)
            look_at_turns(felt_C, turn_C);
        double step = 0.5;
        for (int round = 0; round < 3 && best_.log_likelihood_gain > 0.0; ++round) {
            const double on_C = best_.start.parameter("switch_on_C");
            const double hysteresis_C = best_.start.parameter("hysteresis_C");
            for (const double side : {-1.0, 1.0}) {
                look_at(felt_C, on_C + side * step * hysteresis_C, hysteresis_C);
                look_at(felt_C, on_C, hysteresis_C * std::exp(side * step));
                look_at(felt_C, on_C + side * step * hysteresis_C, hysteresis_C * std::exp(side * step));
            }
            step *= 0.5;
        }
        return best_;
    }

  private:
    void look_at(const Eigen::VectorXd& felt_C, double on_C, double hysteresis_C) {
        look_at(crossings_of(felt_C, run_.seen.time_s, on_C, hysteresis_C), on_C, hysteresis_C);
    }

    void look_at_turns(const Eigen::VectorXd& felt_C, double least_C) {
        const auto turns_s = turns_of(felt_C, run_.seen.time_s, least_C);
        if (turns_s.size() < on_off_on) return;
        const auto [on_C, off_C] = thresholds_C(felt_C, run_.seen.time_s, turns_s);
        look_at(turns_s, on_C, on_C - off_C);
    }

    void look_at(const std::vector<double>& moments_s, double on_C, double hysteresis_C) {
        if (moments_s.size() < on_off_on) return;
        const Eigen::VectorXd change =
            pooled(run_.whitening(answer_to_cooling(answer_to_heat_, run_.seen.time_s, moments_s)),
                   answer_to_heat_.rows());
        const auto gain = linearisation_.gain_of(change);
        if (gain.amplitude <= 0.0 || gain.log_likelihood <= best_.log_likelihood_gain) return;
        best_.log_likelihood_gain = gain.log_likelihood;
        const std::array values = {gain.amplitude, on_C, hysteresis_C};
        for (std::size_t p = 0; p < values.size(); ++p) best_.start.parameters[p].value = values[p];
        best_.moments_s = moments_s;
    }

    const FitData& run_;
    const Linearisation& linearisation_;
    const CourseOfReadings& answer_to_heat_;
    Screened best_;
};

bool is_cooled_already(const Model& model, const std::string& node) {
    return std::ranges::any_of(model.effects, [&](const Effect& effect) {
        return effect.kind == "coolant_cycling" && effect.at == node;
    });
}

std::vector<std::string> nodes_that_speak_for_heat(const std::vector<Nameless>& nameless,
                                                   const Model& model) {
    std::vector<std::string> nodes;
    for (const Nameless& one : nameless) {
        if (one.log_bayes_factor < nats_that_speak_for_heat || nodes.size() == most_nodes) break;
        if (!one.of_sensor && !is_cooled_already(model, one.at)) nodes.push_back(one.at);
    }
    return nodes;
}

}  // namespace

std::vector<Screened> screen_thermostats(const Evidence& evidence, const Explanation& current,
                                         const std::vector<Nameless>& nameless) {
    const std::vector<std::string> nodes = nodes_that_speak_for_heat(nameless, current.fit.model);
    if (nodes.empty()) return {};
    const EffectDefinition& chiller = *find_effect("coolant_cycling");
    const FitProblem problem(evidence.run, current.fit.model);
    const Fit fewer = with_pooled_readings(current.fit);
    const Linearisation linearisation(fewer);
    std::vector<Screened> screened(nodes.size());
    evidence.parallel_for(nodes.size(), [&](std::size_t i) {
        const auto answer = answer_to_heat(problem, current.fit, nodes[i]);
        if (!answer) return;
        ThermostatSearch search(evidence.run, current.fit.model, linearisation, *answer,
                                {&chiller, chiller.form("thermostat"), nodes[i]});
        screened[i] = search.over(felt_C(evidence, current, nodes[i]));
    });
    std::erase_if(screened, [](const Screened& one) { return one.log_likelihood_gain <= 0.0; });
    std::ranges::sort(screened, std::ranges::greater{}, &Screened::log_likelihood_gain);
    return screened;
}

}  // namespace thermbal
