#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/parallel.hpp"
#include "candidates.hpp"
#include "fit.hpp"
#include "gap/diagnose.hpp"
#include "network/simulate.hpp"
#include "placebo.hpp"

namespace thermbal {

/// Everything that stays the same during a diagnosis.
struct Evidence {
    Model prior_model;  ///< without the effects found
    FitData run;
    std::vector<FitData> holdouts;
    std::vector<std::string> room_columns;
    CalibrationOptions calibration;
    ParallelFor parallel_for;
    double spread = 1.0;  ///< uncertainty of prior_model's numbers over what the model states (spread_seen)
};

/// A model with effects, fitted to the run.
struct Explanation {
    std::vector<Effect> effects;  ///< as they stood when the fit began: with the catalogue's priors
    Fit fit;
    double log_evidence = 0.0;    ///< of the run: Laplace
    double log_prediction = 0.0;  ///< of the held-out runs, over what it extends
};

Model with_effects(const Model& model, const std::vector<Effect>& effects);

/// Fits the prior model with these effects. `neighbour`: a fit from which the numbers and sensitivities of
/// what both have in common are taken; null: from the priors, everything computed.
Result<Explanation> explain(const Evidence& evidence, std::vector<Effect> effects,
                            const Explanation* neighbour);

/// Begins at these coordinates of an explanation without the last effect, and computes every sensitivity.
Result<Explanation> explain_anew(const Evidence& evidence, std::vector<Effect> effects,
                                 const Eigen::VectorXd& coordinates);

/// With these of its effects only, in this order, from where it stands: a thermostat would not find back to
/// its moments from the priors.
Result<Explanation> explain_with_only(const Evidence& evidence, const Explanation& explanation,
                                      const std::vector<std::size_t>& kept);

/// The same again with every sensitivity computed at the fit.
Result<Explanation> polish(const Evidence& evidence, const Explanation& explanation);

/// ln of the marginal likelihood of a fit by Laplace's method, up to a constant that all fits of a run share.
double log_evidence(const Fit& fit, double run_length_s);

/// One candidate fitted in full, beside what it is compared with.
struct Contender {
    Candidate candidate;
    Explanation explanation;
    double log_bayes_factor = 0.0;  ///< over the explanation that it extends

    /// The same by the run alone, the held-out runs left out.
    double on_the_run() const { return log_bayes_factor - explanation.log_prediction; }
};

/// What might be missing from an explanation.
struct Survey {
    std::vector<Contender> contenders;  ///< best first
    std::vector<Nameless> nameless;     ///< best first
};
Survey survey(const Evidence& evidence, const Explanation& current);

/// What a model with the explanation's effects does in the run, from where the explanation starts it.
Result<Simulation> simulate_run(const Evidence& evidence, const Explanation& explanation, const Model& model);

struct Forecast {
    double log_density = 0.0;  ///< ln p(held-out run | run), up to a constant of the held-out run
    FitPoint point;            ///< the fit, in the held-out run
    Eigen::MatrixXd
        sensitivity;  ///< of the whitened readings' residual there, by coordinate: numbers, starts, places
};
/// A fit predicts another run; its numbers and the starts of the nodes are no better known than they are.
/// `known_sensitivity`: of a neighbouring explanation with fewer effects, taken for what both have in common.
Result<Forecast> forecast(const FitData& holdout, const Evidence& evidence, const Explanation& explanation,
                          const Eigen::MatrixXd* known_sensitivity = nullptr);

}  // namespace thermbal
