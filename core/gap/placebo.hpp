#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "fit.hpp"
#include "linearisation.hpp"

namespace thermbal {

/// An explanation without a name: heat of any smooth course into one node, or an error of any smooth course
/// of one sensor. What a named effect has to beat, and what says where and when something is missing while it
/// has no name.
struct Nameless {
    bool of_sensor = false;
    std::string at;                 ///< node or channel
    double log_bayes_factor = 0.0;  ///< over "nothing is missing", its freedoms paid for
    std::vector<double> time_s;     ///< middles of the hats that course and sigma are given on
    Eigen::VectorXd course;         ///< W, or C
    Eigen::VectorXd sigma;

    /// Largest |course| / sigma.
    double strongest() const;
    /// Where |course| is beyond two sigma: first and last moment; the whole test when nowhere.
    std::pair<double, double> window_s() const;
};

/// Every node and every sensor, best first. A Gaussian process of unknown size and smoothness over triangular
/// hats, responses linear around the fit, all parameters of the fit free to follow.
std::vector<Nameless> nameless_explanations(const FitProblem& problem, const Fit& fit);

}  // namespace thermbal
