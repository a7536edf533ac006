#include "comparison.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Cholesky>

#include "network/simulate.hpp"
#include "root_mean_square.hpp"

namespace thermbal {
namespace {

/// One linear step is all it takes: the readings answer linearly to the starts.
Result<Inputs> with_estimated_starts(const RecordedTest& test, const FitData& data, const Model& model) {
    const FitProblem problem(data, model);
    const auto point = problem.evaluate(problem.prior_coordinates());
    if (!point) return std::unexpected(point.error());
    const auto numbers = static_cast<Eigen::Index>(problem.parameters().size());
    const auto starts = static_cast<Eigen::Index>(data.starts.size());
    Eigen::MatrixXd sensitivity(point->residual.size(), starts);
    for (Eigen::Index k = 0; k < starts; ++k) {
        const auto column = problem.sensitivity(*point, numbers + k);
        if (!column) return std::unexpected(column.error());
        sensitivity.col(k) = *column;
    }
    const Eigen::VectorXd offsets_C =
        (sensitivity.transpose() * sensitivity).ldlt().solve(-sensitivity.transpose() * point->residual);
    Inputs inputs = inputs_of(test);
    for (Eigen::Index k = 0; k < starts; ++k) {
        for (const std::size_t reading : data.starts[static_cast<std::size_t>(k)].first_readings) {
            inputs.first_readings[reading].value_C += offsets_C(k);
        }
    }
    return inputs;
}

Result<Eigen::MatrixXd> readings_of(const Model& model, const RecordedTest& test, const FitData& data) {
    const auto inputs = with_estimated_starts(test, data, model);
    if (!inputs) return std::unexpected(inputs.error());
    const auto simulation = simulate(model, *inputs, test.time_s);
    if (!simulation) return std::unexpected(simulation.error());
    return Eigen::MatrixXd(simulation->reading_C(Eigen::all, data.seen.sensors));
}

Eigen::MatrixXd measured_of(const RecordedTest& test, const std::vector<std::string>& channels) {
    Eigen::MatrixXd measured_C(static_cast<Eigen::Index>(test.time_s.size()),
                               static_cast<Eigen::Index>(channels.size()));
    for (std::size_t c = 0; c < channels.size(); ++c) {
        const Column& column = *std::ranges::find(test.channels, channels[c], &Column::name);
        for (std::size_t row = 0; row < column.values.size(); ++row) {
            measured_C(static_cast<Eigen::Index>(row), static_cast<Eigen::Index>(c)) = column.values[row];
        }
    }
    return measured_C;
}

Eigen::VectorXd rmse_by_channel(const Eigen::MatrixXd& difference_C) {
    Eigen::VectorXd result(difference_C.cols());
    for (Eigen::Index c = 0; c < difference_C.cols(); ++c) result(c) = root_mean_square(difference_C.col(c));
    return result;
}

}  // namespace

Result<RunComparison> compare_run(const std::string& name, const RecordedTest& test, const FitData& data,
                                  const Model& before, const Model& after) {
    auto before_C = readings_of(before, test, data);
    if (!before_C) return std::unexpected(before_C.error());
    auto after_C = readings_of(after, test, data);
    if (!after_C) return std::unexpected(after_C.error());
    RunComparison run;
    run.name = name;
    run.time_s = test.time_s;
    run.channels = data.seen.channels;
    run.measured_C = measured_of(test, run.channels);
    run.before_C = std::move(*before_C);
    run.after_C = std::move(*after_C);
    run.channel_before_rmse_C = rmse_by_channel(run.measured_C - run.before_C);
    run.channel_after_rmse_C = rmse_by_channel(run.measured_C - run.after_C);
    run.before_rmse_C = root_mean_square(run.measured_C - run.before_C);
    run.after_rmse_C = root_mean_square(run.measured_C - run.after_C);
    return run;
}

}  // namespace thermbal
