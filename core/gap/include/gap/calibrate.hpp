#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "base/error.hpp"
#include "network/model.hpp"
#include "network/parameters.hpp"
#include "series/recorded_test.hpp"

namespace thermbal {

/// How far a lumped network may be from the machine without being wrong. Every channel may wander around the
/// model like a first-order (Ornstein-Uhlenbeck) process, and sits somewhere in its node, so that it rises a
/// little more or less than the node's mean. Fits, tests and evidence all count against noise, wander and
/// place together.
struct ModelFidelity {
    double share_of_rise =
        0.002;  ///< standard deviation of the wander over the channel's own temperature range
    double correlation_s = 1200.0;
    double place_share = 0.006;  ///< standard deviation of (rise at the sensor / rise of its node) - 1
};

struct CalibrationOptions {
    double bin_s = 0.0;  ///< readings are averaged over bins; 0: a four-hundredth of the test, at most 60 s
    ModelFidelity fidelity;
    int max_iterations = 25;
    double chi2_tolerance = 0.02;  ///< of the last step
};

/// One number of the model before and after. Values in the unit that the name carries; sigmas relative for a
/// logarithmic parameter, else in its unit.
struct CalibratedParameter {
    Parameter parameter;  ///< its value, bounds and prior
    double value = 0.0;   ///< fitted
    double sigma = 0.0;   ///< posterior
    bool at_bound = false;
    /// 1 - (posterior / prior)^2: 0, the data say nothing about it; 1, they alone determine it.
    double learned() const;
};

struct ModelCalibration {
    Model model;  ///< fitted values and places of the sensors; sigmas as far as the data went
    std::vector<CalibratedParameter> parameters;
    std::vector<std::string> channels;  ///< the columns of residual_C
    std::vector<double> time_s;         ///< the rows: middles of the bins
    Eigen::MatrixXd residual_C;         ///< measured - simulated, NaN where nothing was measured
    double before_rmse_C = 0.0;         ///< of the model as given, over all bins
    double rmse_C = 0.0;                ///< of the fitted model, started as `simulate` starts it
    double chi2 = 0.0;                  ///< whitened residual and priors
    int readings = 0;                   ///< bins that count
    int iterations = 0;
    bool converged = false;
};

/// Fits every uncertain number of a model to a recorded test: maximum a posteriori, priors as stated in the
/// model, within the bounds; Levenberg-Marquardt with numerical sensitivities; the first readings count as
/// uncertain by the sensor's noise. Errors: refuse_input when no sensor of the model is in the test or the
/// model is not valid. Any thread.
Result<ModelCalibration> calibrate(const Model& model, const RecordedTest& test,
                                   const CalibrationOptions& options = {});

}  // namespace thermbal
