#pragma once

#include <vector>

#include "explanation.hpp"
#include "heat_response.hpp"

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

    /// What the readings of each run do by an effect that sets in at `onset`, a parameter of it, if it does
    /// so at the run's beginning.
    Result<std::vector<CourseOfReadings>> courses_from_the_beginning(Effect effect,
                                                                     const std::string& onset) const;
    /// As change_by, of an effect that sets in at a moment: courses of readings begin then; those of a
    /// sensor's error, which remembers nothing, are what they would have been in the meantime.
    Eigen::VectorXd change_from(const std::vector<CourseOfReadings>& courses, double onset_s,
                                bool remembers) const;

  private:
    struct Run {
        FitProblem problem;
        Fit fit;  ///< model and point: where the explanation stands in this run
        Eigen::MatrixXd sensitivity;
    };
    void stack();
    /// One below the other.
    template <typename ChangeOfRun>
    Result<Eigen::VectorXd> stacked(ChangeOfRun whitened_change) const;

    const Evidence* evidence_;
    const Explanation* current_;
    std::vector<Run> runs_;  ///< the run itself first
    Fit stacked_;
    std::optional<Linearisation> linearisation_;
};

}  // namespace thermbal
