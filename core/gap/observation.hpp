#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "base/error.hpp"
#include "network/model.hpp"
#include "network/simulate.hpp"
#include "series/recorded_test.hpp"

namespace thermbal {

/// A recorded test as a fit sees it: averages over bins, for the sensors of one model.
struct Observation {
    Inputs inputs;               ///< what drives the model; a measured room as its means over the bins
    std::vector<double> time_s;  ///< rows: mean time of each bin
    double bin_s = 0.0;
    std::vector<std::size_t> sensors;   ///< columns: indices into Model::sensors of those that were measured
    std::vector<std::string> channels;  ///< columns: their names
    Eigen::MatrixXd reading_C;          ///< rows x columns, NaN where nothing was measured
    Eigen::MatrixXd sigma_C;            ///< standard deviation of that mean: noise and rounding
    Eigen::VectorXd scan_sigma_C;       ///< columns: of a single reading
    Eigen::VectorXd range_C;            ///< columns: largest - smallest bin

    std::size_t rows() const { return time_s.size(); }
    std::size_t columns() const { return channels.size(); }
};

/// Bin width for a test: `wanted_s`, or when that is 0 a four-hundredth of the test, between one scan and 60
/// s.
double bin_width_s(const RecordedTest& test, double wanted_s);

/// Errors: refuse_input when no sensor of the model has a reading in the test.
Result<Observation> observe(const Model& model, const RecordedTest& test, double bin_s);

/// What a column of the inputs holds at a moment; 0 where it is not there or empty.
double value_at(const Inputs& inputs, const std::string& column, double time_s);

/// Noise of a channel from its own readings: from second differences, so that warming up does not count. NaN
/// with fewer than 20.
double noise_from_differences_C(const std::vector<double>& readings);

/// The step in which a channel was rounded: its smallest difference of two readings; 0 when it cannot be
/// seen.
double rounding_step_C(const std::vector<double>& readings);

}  // namespace thermbal
