#include "calibrate_command.hpp"

#include <cmath>
#include <optional>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "columns.hpp"
#include "config/model_file.hpp"
#include "files.hpp"
#include "gap/calibrate.hpp"
#include "model_input.hpp"
#include "output.hpp"
#include "progress.hpp"
#include "report/verdict_json.hpp"

namespace thermbal {
namespace {

using nlohmann::json;

/// Below this share of the prior's variance taken away, the number in the file is still the engineer's, not
/// the data's.
constexpr double least_learned = 0.1;

bool informed(const CalibratedParameter& parameter) {
    return parameter.learned() >= least_learned;
}

struct Interval {
    double low;
    double high;
};
/// The central 90 % interval of a fitted number.
Interval interval(const CalibratedParameter& fitted) {
    constexpr double quantile = 1.6449;
    const Parameter& parameter = fitted.parameter;
    const double centre = parameter.to_coordinate(fitted.value);
    return {parameter.to_value(centre - quantile * fitted.sigma),
            parameter.to_value(centre + quantile * fitted.sigma)};
}

/// Per channel, over the bins in which it was measured.
double rmse_C(const ModelCalibration& calibration, Eigen::Index channel) {
    double sum = 0.0;
    double count = 0.0;
    for (const double residual_C : calibration.residual_C.col(channel)) {
        if (std::isnan(residual_C)) continue;
        sum += residual_C * residual_C;
        count += 1.0;
    }
    return std::sqrt(sum / count);
}

json parameters_json(const ModelCalibration& calibration) {
    json list = json::array();
    for (const CalibratedParameter& fitted : calibration.parameters) {
        const auto [low, high] = interval(fitted);
        list.push_back({{"name", fitted.parameter.name},
                        {"given", fitted.parameter.value},
                        {"value", fitted.value},
                        {"low", number_or_null(low)},
                        {"high", number_or_null(high)},
                        {fitted.parameter.logarithmic ? "relative_sigma" : "sigma", fitted.sigma},
                        {"learned", fitted.learned()},
                        {"informed", informed(fitted)},
                        {"at_bound", fitted.at_bound}});
    }
    return list;
}

json as_json(const CalibrateCommand& command, const ModelCalibration& calibration) {
    json channels = json::array();
    for (std::size_t i = 0; i < calibration.channels.size(); ++i) {
        channels.push_back({{"channel", calibration.channels[i]},
                            {"rmse_C", number_or_null(rmse_C(calibration, static_cast<Eigen::Index>(i)))}});
    }
    return {{"model", calibration.model.name},
            {"file", command.file},
            {"before_rmse_C", calibration.before_rmse_C},
            {"rmse_C", calibration.rmse_C},
            {"readings", calibration.readings},
            {"converged", calibration.converged},
            {"channels", std::move(channels)},
            {"parameters", parameters_json(calibration)}};
}

std::string verdict_on(const CalibratedParameter& fitted) {
    if (fitted.at_bound) return "at its bound: the model's shape or its relative_sigma is in doubt";
    return informed(fitted) ? "" : "the test says nothing about it";
}

std::string as_text(const CalibrateCommand& command, const ModelCalibration& calibration) {
    TextTable table({{"number", false},
                     {"given", true},
                     {"fitted", true},
                     {"90 % interval", true},
                     {"learned", true},
                     {"", false}});
    for (const CalibratedParameter& fitted : calibration.parameters) {
        const auto [low, high] = interval(fitted);
        table.add({fitted.parameter.name, fmt::format("{:.4g}", fitted.parameter.value),
                   fmt::format("{:.4g}", fitted.value), fmt::format("{:.4g} .. {:.4g}", low, high),
                   fmt::format("{:.0f} %", 100.0 * fitted.learned()), verdict_on(fitted)});
    }
    return table.str() +
           fmt::format(
               "{}: off by {:.3f} C as given, {:.3f} C as fitted ({} readings a minute apart or "
               "more{})\n",
               command.file, calibration.before_rmse_C, calibration.rmse_C, calibration.readings,
               calibration.converged ? "" : "; the fit has not converged");
}

std::string comment_on(const CalibrateCommand& command, const ModelCalibration& calibration) {
    std::string text = fmt::format(
        "Calibrated by thermbalctl calibrate on {}:\noff by {:.3f} C as given, {:.3f} C as "
        "fitted. relative_sigma is how well a number is known now.\n",
        command.file, calibration.before_rmse_C, calibration.rmse_C);
    for (const CalibratedParameter& fitted : calibration.parameters) {
        if (!informed(fitted)) text += fmt::format("Not known any better: {}\n", fitted.parameter.name);
    }
    return text;
}

}  // namespace

int run_calibrate(const CalibrateCommand& command) {
    const auto model = read_model(command.model);
    if (!model) return report_error(model.error());
    const auto test = read_recorded_test(command.file);
    if (!test) return report_error(test.error());
    std::optional<Progress> progress("calibrate");
    const auto calibration = calibrate(*model, *test);
    progress.reset();
    if (!calibration) {
        return report_error(
            {calibration.error().next,
             fmt::format("{} on {}: {}", command.model, command.file, calibration.error().message)});
    }
    if (!command.write_model.empty()) {
        const auto written = write_file(command.write_model,
                                        write_model(calibration->model, comment_on(command, *calibration)));
        if (!written) return report_error(written.error());
    }
    return command.json ? print_json(as_json(command, *calibration))
                        : print_text(as_text(command, *calibration));
}

}  // namespace thermbal
