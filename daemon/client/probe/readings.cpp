#include "readings.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <iterator>
#include <span>

#include "series/calibration.hpp"

namespace thermbal {
namespace {

struct Format {
    RegisterType type;
    ByteOrder order;
    double scale;
    bool is_resistance;
    double prior;  ///< what modules usually do, against what could be as well
};

std::vector<Format> formats() {
    std::vector<Format> all = {
        {RegisterType::int16, ByteOrder::abcd, 0.1, false, 1.0},
        {RegisterType::int16, ByteOrder::abcd, 0.01, false, 0.95},
        {RegisterType::int16, ByteOrder::abcd, 1.0, false, 0.7},
        {RegisterType::uint16, ByteOrder::abcd, 0.1, false, 0.9},
        {RegisterType::int16, ByteOrder::badc, 0.1, false, 0.8},
        {RegisterType::uint16, ByteOrder::abcd, 0.1, true, 0.9},
        {RegisterType::uint16, ByteOrder::abcd, 0.01, true, 0.9},
    };
    constexpr ByteOrder orders[] = {ByteOrder::abcd, ByteOrder::cdab, ByteOrder::badc, ByteOrder::dcba};
    constexpr double order_priors[] = {1.0, 0.98, 0.9, 0.9};
    for (std::size_t i = 0; i < std::size(orders); ++i) {
        all.push_back({RegisterType::float32, orders[i], 1.0, false, order_priors[i]});
        all.push_back({RegisterType::float32, orders[i], 1.0, true, 0.8 * order_priors[i]});
        for (const double scale : {0.1, 0.01, 0.001}) {
            all.push_back({RegisterType::int32, orders[i], scale, false, 0.95 * order_priors[i]});
        }
        all.push_back({RegisterType::int32, orders[i], 0.01, true, 0.8 * order_priors[i]});
    }
    return all;
}

/// What modules send for a sensor that is not there; there are at least six conventions.
bool is_usual_fault(RegisterType type, double number) {
    constexpr std::array faults = {32767.0, -32768.0, -32767.0, 32766.0, 30000.0, -30000.0, 65535.0, 32768.0};
    return std::isnan(number) ||
           (registers_per_value(type) == 1 && std::ranges::find(faults, number) != faults.end());
}

/// A hall is at 10 to 45 C, a machine in it hardly ever above 120 C.
double plausibility(double value_C) {
    if (!std::isfinite(value_C)) return 0.0;
    if (value_C >= 10.0 && value_C <= 45.0) return 1.0;
    return value_C > -30.0 && value_C < 120.0 && value_C != 0.0 ? 0.4 : 0.0;
}

struct Value {
    double C = no_value;
    double score = 0.0;
    bool belongs = false;  ///< to a run of inputs: a temperature or a fault code
};

Value value_of(const ModuleProfile& number_of, const Format& format, std::span<const std::uint16_t> words) {
    const Sample sample = decode(number_of, words);
    if (is_usual_fault(format.type, sample.value_C)) return {.score = 0.2, .belongs = true};
    Value value;
    value.C = sample.value_C * format.scale;
    if (format.is_resistance) value.C = temperature_C(PlatinumCoefficients{}, value.C);
    value.score = plausibility(value.C);
    value.belongs = value.score > 0.0;
    return value;
}

/// A profile that decodes to the bare number.
ModuleProfile bare(const Format& format) {
    ModuleProfile profile;
    profile.type = format.type;
    profile.byte_order = format.order;
    profile.scale = 1.0;
    profile.valid_min_C = -1e30;
    profile.valid_max_C = 1e30;
    return profile;
}

/// Mean squared, so that half-good readings of many registers do not beat a good one of as many.
double score_of(const Format& format, const std::vector<double>& values_C, double sum) {
    std::vector<double> finite;
    std::ranges::copy_if(values_C, std::back_inserter(finite),
                         [](double value) { return std::isfinite(value); });
    if (finite.empty()) return 0.0;
    const double mean = sum / static_cast<double>(values_C.size());
    const auto [low, high] = std::ranges::minmax(finite);
    const double apart = high - low > 40.0 ? 0.6 : 1.0;
    const double alive = finite.size() > 2 && low == high ? 0.5 : 1.0;
    const double registers = static_cast<double>(values_C.size()) * registers_per_value(format.type);
    return format.prior * apart * alive * mean * mean * registers;
}

/// The runs of inputs in one block that this format reads as temperatures.
void add_runs(const RegisterBlock& block, const Format& format, std::size_t phase,
              std::vector<Reading>& readings) {
    const auto width = static_cast<std::size_t>(registers_per_value(format.type));
    const ModuleProfile number_of = bare(format);
    Reading run;
    double sum = 0.0;
    const auto close = [&] {
        run.score = run.values_C.empty() ? 0.0 : score_of(format, run.values_C, sum);
        if (run.score > 0.0) readings.push_back(run);
        run = Reading{};
        sum = 0.0;
    };
    const std::span<const std::uint16_t> words(block.words);
    for (std::size_t at = phase; at + width <= words.size(); at += width) {
        const Value value = value_of(number_of, format, words.subspan(at, width));
        if (!value.belongs) {
            close();
            continue;
        }
        if (run.values_C.empty()) {
            run.is_resistance = format.is_resistance;
            run.profile.function = block.function;
            run.profile.first_register = block.first + static_cast<int>(at);
            run.profile.type = format.type;
            run.profile.byte_order = format.order;
            run.profile.scale = format.scale;
            run.profile.stride = static_cast<int>(width);
        }
        run.values_C.push_back(value.C);
        run.profile.inputs = static_cast<int>(run.values_C.size());
        sum += value.score;
    }
    close();
}

}  // namespace

std::vector<Reading> rank_readings(const RegisterBlock& block, std::size_t most) {
    std::vector<Reading> readings;
    for (const Format& format : formats()) {
        for (std::size_t phase = 0; phase < static_cast<std::size_t>(registers_per_value(format.type));
             ++phase) {
            add_runs(block, format, phase, readings);
        }
    }
    std::ranges::stable_sort(readings, std::greater<>(), &Reading::score);
    if (readings.size() > most) readings.resize(most);
    return readings;
}

double fit_of(const ModuleProfile& profile, const std::vector<Sample>& samples) {
    double sum = 0.0;
    bool any = false;
    for (const Sample& sample : samples) {
        const double score = sample.good() ? plausibility(sample.value_C) : 0.0;
        any = any || score > 0.0;
        const bool says_fault = sample.quality == Quality::open || sample.quality == Quality::shorted;
        sum += says_fault ? 0.5 : score;
    }
    return any ? sum / static_cast<double>(profile.inputs) : 0.0;
}

}  // namespace thermbal
