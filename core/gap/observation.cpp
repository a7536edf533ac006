#include "observation.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

namespace thermbal {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// For every row of the test the bin that it falls into; bins without a row do not exist.
struct Bins {
    std::vector<std::size_t> of_row;
    std::vector<double> time_s;
};

Bins make_bins(const std::vector<double>& time_s, double bin_s) {
    Bins bins;
    double sum_s = 0.0, current = -1.0;
    int count = 0;
    const auto close = [&] {
        if (count > 0) bins.time_s.push_back(sum_s / count);
        sum_s = 0.0;
        count = 0;
    };
    for (const double t : time_s) {
        const double bin = std::floor((t - time_s.front()) / bin_s + 1e-9);
        if (bin != current) close();
        current = bin;
        bins.of_row.push_back(bins.time_s.size());
        sum_s += t;
        ++count;
    }
    close();
    return bins;
}

const Column* find_channel(const RecordedTest& test, const std::string& name) {
    const auto found = std::ranges::find(test.channels, name, &Column::name);
    return found == test.channels.end() ? nullptr : &*found;
}

double single_reading_sigma_C(const Column& column, double stated_C) {
    const double seen_C = noise_from_differences_C(column.values);
    return std::isfinite(seen_C) ? std::clamp(seen_C, 0.5 * stated_C, 3.0 * stated_C) : stated_C;
}

/// Averaging helps against noise; against rounding only as far as the noise dithers it.
double mean_sigma_C(double noise_C, double step_C, int count) {
    const double dithered = noise_C > 0.0 ? std::exp(-std::pow(step_C / (3.0 * noise_C), 2.0)) : 0.0;
    const double rounding = step_C * step_C / 12.0 * (1.0 - dithered);
    return std::sqrt(noise_C * noise_C / count + rounding);
}

/// Means over the bins, NaN where nothing was measured; `count`: of how many rows.
struct BinMeans {
    Eigen::VectorXd value;
    Eigen::VectorXi count;
};

BinMeans bin_means(const std::vector<double>& values, const Bins& bins) {
    const auto rows = static_cast<Eigen::Index>(bins.time_s.size());
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(rows);
    Eigen::VectorXi count = Eigen::VectorXi::Zero(rows);
    for (std::size_t row = 0; row < values.size(); ++row) {
        if (!std::isfinite(values[row])) continue;
        sum(static_cast<Eigen::Index>(bins.of_row[row])) += values[row];
        ++count(static_cast<Eigen::Index>(bins.of_row[row]));
    }
    const auto measured = count.array() > 0;
    return {measured.select(sum.array() / count.cast<double>().array(), nan), std::move(count)};
}

/// What drives a simulation of the test. A measured room counts as its mean over each bin: the heat is the
/// same, the room's noise a step a bin instead of one a scan. Channels that the model has sensors for drive
/// nothing unless it names them.
Inputs binned_inputs(const Model& model, const RecordedTest& test, const Bins& bins) {
    Inputs inputs = inputs_of(test);
    std::erase_if(inputs.columns, [&](const Column& column) {
        const bool drives =
            std::ranges::find(model.sources, column.name, &Source::proportional_to) != model.sources.end() ||
            model.ambient.column == column.name;
        return !drives && find_sensor(model, column.name);
    });
    for (Column& column : inputs.columns) {
        if (column.name != model.ambient.column && find_channel(test, column.name) == nullptr) continue;
        const BinMeans means = bin_means(column.values, bins);
        for (std::size_t row = 0; row < column.values.size(); ++row)
            column.values[row] = means.value(static_cast<Eigen::Index>(bins.of_row[row]));
    }
    return inputs;
}

void fill_column(Observation& seen, Eigen::Index column, const std::vector<double>& readings,
                 const Bins& bins, double noise_C) {
    const double step_C = rounding_step_C(readings);
    const BinMeans means = bin_means(readings, bins);
    double low_C = std::numeric_limits<double>::infinity(), high_C = -low_C;
    for (Eigen::Index row = 0; row < seen.reading_C.rows(); ++row) {
        if (means.count(row) == 0) continue;
        const double mean_C = means.value(row);
        seen.reading_C(row, column) = mean_C;
        seen.sigma_C(row, column) = mean_sigma_C(noise_C, step_C, means.count(row));
        low_C = std::min(low_C, mean_C);
        high_C = std::max(high_C, mean_C);
    }
    seen.range_C(column) = high_C - low_C;
    seen.scan_sigma_C(column) = mean_sigma_C(noise_C, step_C, 1);
}

}  // namespace

double value_at(const Inputs& inputs, const std::string& name, double time_s) {
    const auto column = std::ranges::find(inputs.columns, name, &Column::name);
    if (column == inputs.columns.end()) return 0.0;
    const auto after = std::ranges::upper_bound(inputs.time_s, time_s) - inputs.time_s.begin();
    const double value = column->values[static_cast<std::size_t>(std::max<std::ptrdiff_t>(after - 1, 0))];
    return std::isfinite(value) ? value : 0.0;
}

double noise_from_differences_C(const std::vector<double>& readings) {
    std::vector<double> squares;
    for (std::size_t k = 2; k < readings.size(); ++k) {
        const double second = readings[k] - 2.0 * readings[k - 1] + readings[k - 2];
        if (std::isfinite(second)) squares.push_back(second * second);
    }
    if (squares.size() < 20) return nan;
    std::ranges::sort(squares);
    squares.resize(squares.size() - squares.size() / 100);  // spikes
    double sum = 0.0;
    for (const double square : squares) sum += square;
    return std::sqrt(sum /
                     (6.0 * 0.95 * static_cast<double>(squares.size())));  // 0.95: what the cut takes away
}

double rounding_step_C(const std::vector<double>& readings) {
    double step_C = std::numeric_limits<double>::infinity();
    double last = nan;
    for (const double reading : readings) {
        const double difference = std::abs(reading - last);
        if (std::isfinite(difference) && difference > 1e-6) step_C = std::min(step_C, difference);
        if (std::isfinite(reading)) last = reading;
    }
    return std::isfinite(step_C) ? step_C : 0.0;
}

double bin_width_s(const RecordedTest& test, double wanted_s) {
    if (wanted_s > 0.0) return wanted_s;
    const double scan_s = median_step_s(test);
    const double length_s = test.time_s.empty() ? 0.0 : test.time_s.back() - test.time_s.front();
    return std::max(scan_s, std::min(60.0, length_s / 400.0));
}

Result<Observation> observe(const Model& model, const RecordedTest& test, double bin_s) {
    Observation seen;
    bool machine_is_measured = false;  // the room alone is an input, and agrees with any model
    for (std::size_t i = 0; i < model.sensors.size(); ++i) {
        const Column* column = find_channel(test, model.sensors[i].channel);
        if (column == nullptr) continue;
        if (std::ranges::none_of(column->values, [](double value) { return std::isfinite(value); })) continue;
        seen.sensors.push_back(i);
        seen.channels.push_back(model.sensors[i].channel);
        machine_is_measured = machine_is_measured || model.sensors[i].node != ambient_node;
    }
    if (!machine_is_measured || test.time_s.size() < 3) {
        return fail(NextStep::refuse_input,
                    fmt::format("no sensor on the machine of the model \"{}\" is measured in the test, so "
                                "nothing can be compared; "
                                "expected columns named as its [[sensor]] channels, at least three rows",
                                model.name));
    }
    const Bins bins = make_bins(test.time_s, bin_s);
    seen.bin_s = bin_s;
    seen.inputs = binned_inputs(model, test, bins);
    seen.time_s = bins.time_s;
    const auto rows = static_cast<Eigen::Index>(seen.rows());
    const auto columns = static_cast<Eigen::Index>(seen.columns());
    seen.reading_C = Eigen::MatrixXd::Constant(rows, columns, nan);
    seen.sigma_C = Eigen::MatrixXd::Constant(rows, columns, nan);
    seen.scan_sigma_C = Eigen::VectorXd::Zero(columns);
    seen.range_C = Eigen::VectorXd::Zero(columns);
    for (Eigen::Index column = 0; column < columns; ++column) {
        const Sensor& sensor = model.sensors[seen.sensors[static_cast<std::size_t>(column)]];
        const Column& readings = *find_channel(test, sensor.channel);
        fill_column(seen, column, readings.values, bins, single_reading_sigma_C(readings, sensor.noise_C));
    }
    return seen;
}

}  // namespace thermbal
