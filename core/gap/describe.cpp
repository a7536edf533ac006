#include "describe.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <Eigen/Cholesky>

#include "experiments.hpp"
#include "root_mean_square.hpp"
#include "thermostats.hpp"

namespace thermbal {
namespace {

/// A name that stands for something it does not describe well is never more than a suspicion.
constexpr double relative_low = 0.25, relative_high = 0.40;

std::string place_of(const Effect& effect, const Model& model) {
    const EffectSite site = form_of(effect).site;
    if (site == EffectSite::whole_model || site == EffectSite::column)
        return effect.kind == "spindle_stop" ? "all" : "ambient";
    return site == EffectSite::channel ? effect.at : node_of_place(site, effect.at, model);
}

/// From the onset that the effect has, for as long as it says; else the whole test.
std::pair<double, double> window_of(const Effect& effect, const Observation& seen) {
    const double from_s = onset_of(effect).value_or(seen.time_s.front());
    double to_s = seen.time_s.back();
    const double duration_s = effect.parameter("duration_s");
    if (std::isfinite(duration_s)) to_s = std::min(to_s, from_s + duration_s);
    return {from_s, to_s};
}

std::vector<CalibratedParameter> numbers_of(const Fit& fit, std::size_t effect) {
    const Eigen::MatrixXd covariance =
        fit.hessian.ldlt().solve(Eigen::MatrixXd::Identity(fit.jacobian.cols(), fit.jacobian.cols()));
    std::vector<CalibratedParameter> numbers;
    for (std::size_t i = 0; i < fit.parameters.size(); ++i) {
        const Parameter& parameter = fit.parameters[i];
        if (!parameter.of_effect || parameter.effect != effect) continue;
        const auto k = static_cast<Eigen::Index>(i);
        const double value = parameter.to_value(fit.point.coordinates(k));
        numbers.push_back({parameter, value, std::sqrt(std::max(covariance(k, k), 0.0)),
                           value <= parameter.lower || value >= parameter.upper});
    }
    return numbers;
}

std::vector<std::string> channels_changed(const FitProblem& problem, const Fit& fit, const Fit& without) {
    const Observation& seen = problem.data().seen;
    const Eigen::MatrixXd change_C = fit.point.simulated_C - without.point.simulated_C;
    const Eigen::VectorXd largest_C = change_C.cwiseAbs().colwise().maxCoeff();
    std::vector<std::string> channels;
    for (std::size_t c = 0; c < seen.columns(); ++c) {
        const auto k = static_cast<Eigen::Index>(c);
        if (largest_C(k) > std::max(seen.scan_sigma_C(k), 0.3 * largest_C.maxCoeff()))
            channels.push_back(seen.channels[c]);
    }
    return channels;
}

/// What would tell the k-th effect from the alternatives that the data leave.
std::vector<SeparatingExperiment> experiments_against(const Evidence& evidence, const SearchResult& search,
                                                      std::size_t k,
                                                      const std::vector<Suspect>& alternatives) {
    constexpr double least_probability = 0.05;
    constexpr std::size_t most_rivals = 3;
    if (std::ranges::none_of(alternatives, [](const Suspect& one) {
            return !one.kind.empty() && one.probability >= least_probability;
        }))
        return {};
    std::vector<std::size_t> others(search.current.effects.size());
    std::iota(others.begin(), others.end(), 0);
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(k));
    const auto without = others.empty() ? Result<Explanation>(search.base)
                                        : explain_with_only(evidence, search.current, others);
    if (!without) return {};
    return separating_experiments(
        evidence.run, search.current.fit.model,
        fitted_rivals(evidence, *without, alternatives, least_probability, most_rivals));
}

}  // namespace

std::vector<Suspect> suspects_of(const Odds& odds, double least) {
    std::vector<Suspect> suspects;
    for (const Suspect& suspect : odds.kinds) {
        if (suspect.probability >= least) suspects.push_back(suspect);
    }
    if (odds.nameless >= least) suspects.push_back({"", "", odds.nameless, 0.0});
    std::ranges::sort(suspects, std::ranges::greater{}, &Suspect::probability);
    return suspects;
}

Result<std::vector<FoundEffect>> describe_effects(const Evidence& evidence, const SearchResult& search,
                                                  const Model& written, const DiagnoseOptions& options) {
    std::vector<FoundEffect> found;
    const Fit& fit = search.current.fit;
    Explanation before = search.base;
    std::vector<std::size_t> so_far;
    for (std::size_t k = 0; k < search.steps.size(); ++k) {
        so_far.push_back(k);
        Explanation after = search.current;
        if (k + 1 < search.steps.size()) {
            auto fitted = explain_with_only(evidence, search.current, so_far);
            if (!fitted) return std::unexpected(fitted.error());
            after = std::move(*fitted);
        }
        const FitProblem problem(evidence.run, fit.model);
        const Odds& odds = search.steps[k].odds;
        FoundEffect one;
        one.effect = written.effects[evidence.prior_model.effects.size() + k];
        one.at = place_of(one.effect, fit.model);
        one.channels = channels_changed(problem, after.fit, before.fit);
        std::tie(one.from_s, one.to_s) = window_of(one.effect, evidence.run.seen);
        one.parameters = numbers_of(fit, evidence.prior_model.effects.size() + k);
        one.cycle_s = cycle_of(one.effect, written, evidence.run.seen);
        for (const Suspect& suspect : suspects_of(odds, 0.0)) {
            if (suspect.kind == one.effect.kind) {
                one.probability = suspect.probability;
            } else if (suspect.probability >= options.probability_to_list) {
                one.alternatives.push_back(suspect);
            }
        }
        one.in_doubt = search.steps[k].doubtful;
        if (one.in_doubt) one.probability = std::clamp(one.probability, relative_low, relative_high);
        one.effect.provenance = {options.found_on, one.probability, ""};
        for (std::size_t p = 0; p < one.effect.parameters.size() && p < one.parameters.size(); ++p) {
            CalibratedParameter& described = one.parameters[p];
            EffectParameter& in_file = one.effect.parameters[p];
            in_file.sigma = sigma_in_unit(described.parameter.logarithmic, in_file.value, described.sigma);
            if (described.at_bound) described.value = in_file.value;
        }
        one.experiments = experiments_against(evidence, search, k, one.alternatives);
        one.rmse_before_C = root_mean_square(before.fit.point.difference_C);
        one.rmse_after_C = root_mean_square(after.fit.point.difference_C);
        found.push_back(std::move(one));
        before = std::move(after);
    }
    std::ranges::stable_sort(found, std::ranges::greater{}, [](const FoundEffect& one) {
        return std::pair{!one.in_doubt, one.rmse_before_C - one.rmse_after_C};
    });
    return found;
}

}  // namespace thermbal
