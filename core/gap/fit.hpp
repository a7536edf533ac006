#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "base/error.hpp"
#include "base/parallel.hpp"
#include "gap/calibrate.hpp"
#include "network/parameters.hpp"
#include "observation.hpp"
#include "whitening.hpp"

namespace thermbal {

/// What a model is fitted against: the thinned test and how differences count.
struct FitData {
    Observation seen;
    Whitening whitening;
    /// The first readings carry noise, and every node starts at one. These columns say which readings start a
    /// node together, and how uncertain their mean is.
    struct Start {
        std::vector<std::size_t> first_readings;  ///< indices into Inputs::first_readings
        double sigma_C;
    };
    std::vector<Start> starts;
    double place_sigma = 0.0;     ///< ModelFidelity::place_share
    double gradient_sigma = 0.0;  ///< the same, of what a gradient may be over its column's range
    /// A node that is heated is warmer where the heat enters, as long as it does: a sensor on it reads a
    /// little more or less than the node's mean, in proportion to the heat.
    struct Gradient {
        Eigen::Index column;
        Eigen::VectorXd drive;  ///< rows: heat of the node's sources over their heat at the references
        double range_C;         ///< of the column: gradient_sigma of it is what the gradient may be
    };
    std::vector<Gradient> gradients;

    /// Coordinates of a fit that are not the model's: the starts, each column's place, the gradients in C.
    Eigen::Index nuisances() const {
        return static_cast<Eigen::Index>(starts.size() + seen.columns() + gradients.size());
    }
    /// Among a fit's coordinates, each column's place.
    Eigen::VectorXd places_in(const Eigen::VectorXd& coordinates) const {
        return coordinates.tail(nuisances())
            .segment(static_cast<Eigen::Index>(starts.size()), static_cast<Eigen::Index>(seen.columns()));
    }
};

Result<FitData> make_fit_data(const Model& model, const RecordedTest& test,
                              const CalibrationOptions& options);

/// Where a fit stands. Coordinates: those of `parameters` (the logarithm where logarithmic), then the offsets
/// of the starts in C.
struct FitPoint {
    Eigen::VectorXd coordinates;
    Eigen::MatrixXd model_C;       ///< what the model alone says: bins x observed sensors
    Eigen::MatrixXd simulated_C;   ///< the same with each sensor's place and gradient
    Eigen::MatrixXd difference_C;  ///< measured - simulated
    Eigen::VectorXd residual;      ///< whitened differences, then the priors
    double chi2 = 0.0;
};

struct Fit {
    Model model;  ///< at the fitted values; parameters_of(prior model) names its numbers
    std::vector<Parameter> parameters;  ///< with priors as before the fit
    FitPoint point;
    Eigen::MatrixXd jacobian;  ///< of point.residual
    Eigen::MatrixXd hessian;   ///< jacobian' jacobian
    int iterations = 0;
    bool converged = false;
};

/// The fitted model with each sensor where the fit has it in its node.
Model with_places(const Fit& fit, const FitData& data);

using Simulated = Result<Eigen::MatrixXd>;

/// A model with open numbers, against data. Copies nothing of the data: FitData must outlive it.
class FitProblem {
  public:
    /// `prior_model`: values are the priors' centres. REQUIRES: valid.
    FitProblem(const FitData& data, Model prior_model);

    const std::vector<Parameter>& parameters() const { return parameters_; }
    bool steers_itself() const { return steers_itself_; }
    const FitData& data() const { return *data_; }
    Eigen::Index dimensions() const {
        return static_cast<Eigen::Index>(parameters_.size()) + data_->nuisances();
    }
    /// The priors' centres, the rest at zero.
    Eigen::VectorXd prior_coordinates() const;
    Model model_at(const Eigen::VectorXd& coordinates) const;
    /// The run's inputs, with the starts that are among the coordinates.
    Inputs inputs_at(const Eigen::VectorXd& coordinates) const;
    Result<FitPoint> evaluate(const Eigen::VectorXd& coordinates) const;
    /// Column of the Jacobian of FitPoint::residual by difference quotient.
    Result<Eigen::VectorXd> sensitivity(const FitPoint& point, Eigen::Index coordinate) const;
    /// How the readings of a fit change when an effect is added to it, in C (rows x columns of the
    /// observation), and the same whitened.
    Simulated reading_change_by(const Fit& fit, const Effect& effect) const;
    Result<Eigen::VectorXd> change_by(const Fit& fit, const Effect& effect) const;
    Eigen::VectorXd lower() const;
    Eigen::VectorXd upper() const;

  private:
    /// Readings of the observed sensors at the bins as the model says them, from the starts among the
    /// coordinates.
    Simulated simulated(const Model& model, const Eigen::VectorXd& coordinates) const;
    /// The same with the sensors' places and gradients among the coordinates.
    Eigen::MatrixXd as_placed(Eigen::MatrixXd model_C, const Eigen::VectorXd& coordinates) const;
    FitPoint point_at(const Eigen::VectorXd& coordinates, Eigen::MatrixXd model_C) const;
    /// Whether a coordinate is one that only as_placed looks at.
    bool is_of_a_place(Eigen::Index coordinate) const;
    double nuisance_sigma(Eigen::Index nuisance) const;
    /// Standard deviation of a flat prior: no number is less known than its bounds, no moment less than the
    /// run.
    double flat_sigma(const Parameter& parameter) const;
    double step_of(Eigen::Index coordinate, const FitPoint& point) const;

    const FitData* data_;
    Model prior_model_;
    std::vector<Parameter> parameters_;
    bool steers_itself_;  ///< an effect of the model does, and is not held
};

/// What a fit may start from and how far it goes.
struct FitStart {
    Eigen::VectorXd coordinates;
    /// Sensitivities of the leading coordinates, known from a fit nearby; they are not computed again. Empty:
    /// all are.
    const Eigen::MatrixXd* known_jacobian = nullptr;
};

/// Levenberg-Marquardt within bounds, the sensitivities by `parallel_for`. Errors: those of the simulation at
/// the start; stop when cancelled, which is asked before each simulation.
Result<Fit> minimise(const FitProblem& problem, const FitStart& start, const CalibrationOptions& options,
                     const ParallelFor& parallel_for, const Cancelled& cancelled = never_cancelled);

}  // namespace thermbal
