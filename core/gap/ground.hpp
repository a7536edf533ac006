#pragma once

#include <vector>

#include "explanation.hpp"

namespace thermbal {

/// Where candidates are screened: the run together with the held-out runs, linear around one explanation.
/// Readings are pooled over three bins. Nothing is fitted to the held-out runs; they only say which
/// candidates are worth fitting to the run.
class ScreeningGround {
  public:
    /// Both outlive it. A held-out run that cannot be simulated is left out.
    ScreeningGround(const Evidence& evidence, const Explanation& current);

    const Observation& run() const { return evidence_->run.seen; }
    const Model& model() const { return current_->fit.model; }
    const Linearisation& linearisation() const { return *linearisation_; }
    /// How the whitened readings of all runs change by an effect, one below the other.
    Result<Eigen::VectorXd> change_by(const Effect& effect) const;

  private:
    struct Run {
        FitProblem problem;
        Fit fit;  ///< model and point: where the explanation stands in this run
        Eigen::MatrixXd sensitivity;
    };
    void stack();

    const Evidence* evidence_;
    const Explanation* current_;
    std::vector<Run> runs_;  ///< the run itself first
    Fit stacked_;
    std::optional<Linearisation> linearisation_;
};

}  // namespace thermbal
