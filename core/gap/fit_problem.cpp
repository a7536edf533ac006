#include <algorithm>
#include <cmath>
#include <limits>

#include "fit.hpp"
#include "network/effect.hpp"
#include "network/simulate.hpp"

namespace thermbal {
namespace {

/// What a start and a sensor's place may be off by at most: they must not swallow what the model lacks.
constexpr double most_nuisance_sigmas = 3.0;
constexpr double infinity = std::numeric_limits<double>::infinity();

/// First readings on the same node belong together.
std::vector<FitData::Start> starts_of(const Model& model, const Observation& seen) {
    std::vector<FitData::Start> starts;
    std::vector<std::string> nodes;
    for (std::size_t reading = 0; reading < seen.inputs.first_readings.size(); ++reading) {
        const auto sensor = find_sensor(model, seen.inputs.first_readings[reading].channel);
        if (!sensor || model.sensors[*sensor].node == ambient_node) continue;
        const auto column = std::ranges::find(seen.sensors, *sensor) - seen.sensors.begin();
        if (static_cast<std::size_t>(column) == seen.columns()) continue;
        const std::string& node = model.sensors[*sensor].node;
        auto k = static_cast<std::size_t>(std::ranges::find(nodes, node) - nodes.begin());
        if (k == nodes.size()) {
            nodes.push_back(node);
            starts.push_back({{}, 0.0});
        }
        const auto so_far = static_cast<double>(starts[k].first_readings.size());
        const double sum_C = starts[k].sigma_C * so_far;
        starts[k].first_readings.push_back(reading);
        starts[k].sigma_C = std::hypot(sum_C, seen.scan_sigma_C(column)) / (so_far + 1.0);
    }
    return starts;
}

/// Heat of a node's sources at a moment, over their heat at the references; 0 without sources.
double drive_of(const Model& model, const std::string& node, const Inputs& inputs, double time_s) {
    double heat_W = 0.0, reference_W = 0.0;
    for (const Source& source : model.sources) {
        if (source.node != node) continue;
        const double share =
            source.proportional_to.empty()
                ? 1.0
                : std::pow(std::abs(value_at(inputs, source.proportional_to, time_s) / source.reference),
                           source.exponent.value);
        heat_W += share * source.power_W.value;
        reference_W += source.power_W.value;
    }
    return reference_W > 0.0 ? heat_W / reference_W : 0.0;
}

std::vector<FitData::Gradient> gradients_of(const Model& model, const Observation& seen) {
    std::vector<FitData::Gradient> gradients;
    for (std::size_t c = 0; c < seen.columns(); ++c) {
        const auto column = static_cast<Eigen::Index>(c);
        Eigen::VectorXd drive(static_cast<Eigen::Index>(seen.rows()));
        for (std::size_t row = 0; row < seen.rows(); ++row) {
            drive(static_cast<Eigen::Index>(row)) =
                drive_of(model, model.sensors[seen.sensors[c]].node, seen.inputs, seen.time_s[row]);
        }
        if (drive.cwiseAbs().maxCoeff() > 0.0)
            gradients.push_back({column, std::move(drive), seen.range_C(column)});
    }
    return gradients;
}

double bounded_log(double value) {
    return value > 0.0 ? std::log(value) : -infinity;
}

}  // namespace

Result<FitData> make_fit_data(const Model& model, const RecordedTest& test,
                              const CalibrationOptions& options) {
    auto seen = observe(model, test, bin_width_s(test, options.bin_s));
    if (!seen) return std::unexpected(seen.error());
    FitData data{std::move(*seen), {}, {}, options.fidelity.place_share, options.fidelity.place_share, {}};
    data.whitening = Whitening(data.seen, options.fidelity);
    data.starts = starts_of(model, data.seen);
    data.gradients = gradients_of(model, data.seen);
    return data;
}

Model with_places(const Fit& fit, const FitData& data) {
    Model model = fit.model;
    const Eigen::VectorXd places = data.places_in(fit.point.coordinates);
    for (std::size_t c = 0; c < data.seen.columns(); ++c) {
        double& place_share = model.sensors[data.seen.sensors[c]].place_share;
        place_share = (1.0 + place_share) * (1.0 + places(static_cast<Eigen::Index>(c))) - 1.0;
    }
    return model;
}

FitProblem::FitProblem(const FitData& data, Model prior_model)
    : data_(&data),
      prior_model_(std::move(prior_model)),
      parameters_(parameters_of(prior_model_)),
      steers_itself_(std::ranges::any_of(prior_model_.effects, [&](const Effect& effect) {
          const auto& held = data.seen.inputs.seen_switchings;
          return form_of(effect).steers_itself &&
                 std::ranges::find(held, effect.at, &Inputs::SeenSwitchings::node) == held.end();
      })) {}

Eigen::VectorXd FitProblem::prior_coordinates() const {
    Eigen::VectorXd coordinates = Eigen::VectorXd::Zero(dimensions());
    for (std::size_t i = 0; i < parameters_.size(); ++i) {
        coordinates(static_cast<Eigen::Index>(i)) = parameters_[i].to_coordinate(parameters_[i].value);
    }
    return coordinates;
}

Model FitProblem::model_at(const Eigen::VectorXd& coordinates) const {
    Model model = prior_model_;
    std::vector<double> values(parameters_.size());
    for (std::size_t i = 0; i < values.size(); ++i) {
        values[i] = parameters_[i].to_value(coordinates(static_cast<Eigen::Index>(i)));
    }
    set_parameter_values(model, values);
    return model;
}

Inputs FitProblem::inputs_at(const Eigen::VectorXd& coordinates) const {
    Inputs inputs = data_->seen.inputs;
    const auto nuisances = coordinates.tail(data_->nuisances());
    for (std::size_t k = 0; k < data_->starts.size(); ++k) {
        for (const std::size_t reading : data_->starts[k].first_readings) {
            inputs.first_readings[reading].value_C += nuisances(static_cast<Eigen::Index>(k));
        }
    }
    return inputs;
}

Simulated FitProblem::simulated(const Model& model, const Eigen::VectorXd& coordinates) const {
    const auto simulation = simulate(model, inputs_at(coordinates), data_->seen.time_s);
    if (!simulation) return std::unexpected(simulation.error());
    return simulation->reading_C(Eigen::all, data_->seen.sensors);
}

Eigen::MatrixXd FitProblem::as_placed(Eigen::MatrixXd readings_C, const Eigen::VectorXd& coordinates) const {
    const Eigen::VectorXd places = data_->places_in(coordinates);
    for (Eigen::Index column = 0; column < readings_C.cols(); ++column) {
        const double start_C = readings_C(0, column);
        readings_C.col(column).array() += places(column) * (readings_C.col(column).array() - start_C);
    }
    const auto gradients_C = coordinates.tail(static_cast<Eigen::Index>(data_->gradients.size()));
    for (std::size_t k = 0; k < data_->gradients.size(); ++k) {
        const FitData::Gradient& gradient = data_->gradients[k];
        readings_C.col(gradient.column) += gradients_C(static_cast<Eigen::Index>(k)) * gradient.drive;
    }
    return readings_C;
}

Simulated FitProblem::reading_change_by(const Fit& fit, const Effect& effect) const {
    Model model = fit.model;
    model.effects.push_back(effect);
    const auto model_C = simulated(model, fit.point.coordinates);
    if (!model_C) return std::unexpected(model_C.error());
    return as_placed(*model_C, fit.point.coordinates) - fit.point.simulated_C;
}

Result<Eigen::VectorXd> FitProblem::change_by(const Fit& fit, const Effect& effect) const {
    const auto change_C = reading_change_by(fit, effect);
    if (!change_C) return std::unexpected(change_C.error());
    return data_->whitening(*change_C);
}

Result<FitPoint> FitProblem::evaluate(const Eigen::VectorXd& coordinates) const {
    auto model_C = simulated(model_at(coordinates), coordinates);
    if (!model_C) return std::unexpected(model_C.error());
    return point_at(coordinates, std::move(*model_C));
}

FitPoint FitProblem::point_at(const Eigen::VectorXd& coordinates, Eigen::MatrixXd model_C) const {
    const Observation& seen = data_->seen;
    const auto count = static_cast<Eigen::Index>(parameters_.size());
    FitPoint point{coordinates, std::move(model_C), {}, {}, {}, 0.0};
    point.simulated_C = as_placed(point.model_C, coordinates);
    point.difference_C = seen.reading_C - point.simulated_C;
    point.residual.resize(seen.reading_C.size() + dimensions());
    point.residual.head(seen.reading_C.size()) = data_->whitening(point.difference_C);
    auto priors = point.residual.tail(dimensions());
    for (Eigen::Index i = 0; i < count; ++i) {
        const Parameter& parameter = parameters_[static_cast<std::size_t>(i)];
        priors(i) = parameter.prior_residual(parameter.to_value(coordinates(i)));
    }
    for (Eigen::Index i = count; i < dimensions(); ++i)
        priors(i) = coordinates(i) / nuisance_sigma(i - count);
    point.chi2 = point.residual.squaredNorm();
    return point;
}

Eigen::VectorXd FitProblem::lower() const {
    Eigen::VectorXd bound = Eigen::VectorXd::Constant(dimensions(), -infinity);
    for (std::size_t i = 0; i < parameters_.size(); ++i) {
        const Parameter& p = parameters_[i];
        bound(static_cast<Eigen::Index>(i)) = p.logarithmic ? bounded_log(p.lower) : p.lower;
    }
    for (Eigen::Index k = 0; k < data_->nuisances(); ++k) {
        bound(static_cast<Eigen::Index>(parameters_.size()) + k) = -most_nuisance_sigmas * nuisance_sigma(k);
    }
    return bound;
}

Eigen::VectorXd FitProblem::upper() const {
    Eigen::VectorXd bound = Eigen::VectorXd::Constant(dimensions(), infinity);
    for (std::size_t i = 0; i < parameters_.size(); ++i) {
        const Parameter& p = parameters_[i];
        bound(static_cast<Eigen::Index>(i)) = p.to_coordinate(p.upper);
    }
    for (Eigen::Index k = 0; k < data_->nuisances(); ++k) {
        bound(static_cast<Eigen::Index>(parameters_.size()) + k) = most_nuisance_sigmas * nuisance_sigma(k);
    }
    return bound;
}

bool FitProblem::is_of_a_place(Eigen::Index coordinate) const {
    return coordinate >= static_cast<Eigen::Index>(parameters_.size() + data_->starts.size());
}

double FitProblem::nuisance_sigma(Eigen::Index nuisance) const {
    const auto k = static_cast<std::size_t>(nuisance);
    const std::size_t before_gradients = data_->starts.size() + data_->seen.columns();
    if (k < data_->starts.size()) return data_->starts[k].sigma_C;
    if (k < before_gradients) return data_->place_sigma;
    return data_->gradient_sigma * std::max(data_->gradients[k - before_gradients].range_C, 1e-3);
}

double FitProblem::flat_sigma(const Parameter& parameter) const {
    const double run_s = data_->seen.time_s.back() - data_->seen.time_s.front();
    const double range = parameter.is_time ? run_s : parameter.upper - parameter.lower;
    return range / std::sqrt(12.0);
}

/// Small against what the coordinate may do, large against the integrator's own error; across a bin for a
/// moment of time, because between the samples nothing changes.
double FitProblem::step_of(Eigen::Index coordinate, const FitPoint& point) const {
    const auto count = static_cast<Eigen::Index>(parameters_.size());
    if (coordinate >= count) return nuisance_sigma(coordinate - count);
    const Parameter& p = parameters_[static_cast<std::size_t>(coordinate)];
    if (p.is_time) {
        const double step_s = 0.5 * data_->seen.bin_s;
        return p.logarithmic ? step_s / std::max(std::exp(point.coordinates(coordinate)), step_s) : step_s;
    }
    if (p.name.ends_with(
            "period_s")) {  // many cycles long: a small change of the period moves the last one far
        const double cycles = (data_->seen.time_s.back() - data_->seen.time_s.front()) /
                              p.to_value(point.coordinates(coordinate));
        return 0.05 / std::max(cycles, 1.0);
    }
    // A thermostat's moments of switching move much with little, and what follows repeats.
    const double share = steers_itself_ ? 0.001 : 0.01;
    if (p.logarithmic) return share;
    if (p.name.ends_with("switch_on_C")) return share * data_->seen.range_C.maxCoeff();
    const double spread = std::isinf(p.prior_sigma) ? p.upper - p.lower : p.prior_sigma;
    return share * spread;
}

Result<Eigen::VectorXd> FitProblem::sensitivity(const FitPoint& point, Eigen::Index coordinate) const {
    const bool number = coordinate < static_cast<Eigen::Index>(parameters_.size());
    const Parameter* parameter = number ? &parameters_[static_cast<std::size_t>(coordinate)] : nullptr;
    double step = step_of(coordinate, point);
    Eigen::VectorXd moved = point.coordinates;
    moved(coordinate) += step;
    if (moved(coordinate) > upper()(coordinate)) moved(coordinate) -= 2.0 * step;
    step = moved(coordinate) - point.coordinates(coordinate);
    const auto ahead =
        is_of_a_place(coordinate) ? Result<FitPoint>(point_at(moved, point.model_C)) : evaluate(moved);
    if (!ahead) return std::unexpected(ahead.error());
    Eigen::VectorXd column = (ahead->residual - point.residual) / step;
    if (number && parameter->is_time) {
        moved(coordinate) = point.coordinates(coordinate) - step;
        const auto behind = evaluate(moved);
        if (!behind) return std::unexpected(behind.error());
        column = (ahead->residual - behind->residual) / (2.0 * step);
    }
    // A flat prior pulls nowhere, but it bounds how unknown the number can be.
    if (number && std::isinf(parameter->prior_sigma))
        column(data_->seen.reading_C.size() + coordinate) = 1.0 / flat_sigma(*parameter);
    return column;
}

}  // namespace thermbal
