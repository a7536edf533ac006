#include "series/calibration.hpp"

#include <cmath>
#include <limits>

#include <fmt/format.h>

namespace thermbal {
namespace {

constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();
constexpr double nominal_ohms[] = {100.0, 500.0, 1000.0};

/// By 1 %: ten times the tolerance of the worst class of IEC 60751.
double nominal_ohm(double R0_ohm) {
    for (const double nominal : nominal_ohms) {
        if (std::abs(R0_ohm - nominal) <= 0.01 * nominal) return nominal;
    }
    return not_a_number;
}

double slope_ohm_per_C(const PlatinumCoefficients& sensor, double t_C) {
    const double below = t_C < 0.0 ? sensor.C * (4.0 * t_C - 300.0) * t_C * t_C : 0.0;
    return sensor.R0_ohm * (sensor.A + 2.0 * sensor.B * t_C + below);
}

}  // namespace

double resistance_ohm(const PlatinumCoefficients& sensor, double t_C) {
    const double below = t_C < 0.0 ? sensor.C * (t_C - 100.0) * t_C * t_C * t_C : 0.0;
    return sensor.R0_ohm * (1.0 + sensor.A * t_C + sensor.B * t_C * t_C + below);
}

double temperature_C(const PlatinumCoefficients& sensor, double resistance) {
    if (!(resistance >= resistance_ohm(sensor, -205.0) && resistance <= resistance_ohm(sensor, 900.0))) {
        return not_a_number;
    }
    double t_C = (resistance / sensor.R0_ohm - 1.0) / sensor.A;
    // Newton on a curve that is nearly a line: four steps reach the last digit, the others are for a
    // certificate at the edge of what is accepted.
    for (int step = 0; step < 12; ++step) {
        t_C -= (resistance_ohm(sensor, t_C) - resistance) / slope_ohm_per_C(sensor, t_C);
    }
    return t_C;
}

std::string check_coefficients(const PlatinumCoefficients& sensor) {
    const auto outside = [](double value, double low, double high) {
        return !(value >= low && value <= high);
    };
    if (!std::isfinite(nominal_ohm(sensor.R0_ohm))) {
        return fmt::format("R0_ohm is {}; within 1 % of 100, 500 or 1000", sensor.R0_ohm);
    }
    if (outside(sensor.A, 3.8e-3, 4.0e-3)) return fmt::format("A is {}; 3.8e-3 to 4.0e-3", sensor.A);
    if (outside(sensor.B, -7.5e-7, -4.0e-7)) return fmt::format("B is {}; -7.5e-7 to -4.0e-7", sensor.B);
    if (outside(sensor.C, -1.0e-11, 0.0)) return fmt::format("C is {}; -1.0e-11 to 0", sensor.C);
    return {};
}

double calibrated_C(const Calibration& calibration, double source_C) {
    if (!calibration.certificate) return source_C + calibration.offset_C;
    PlatinumCoefficients assumed;
    assumed.R0_ohm = nominal_ohm(calibration.certificate->R0_ohm);
    return temperature_C(*calibration.certificate, resistance_ohm(assumed, source_C));
}

std::string describe(const Calibration& calibration) {
    if (calibration.none()) return {};
    if (!calibration.certificate) return fmt::format("offset {:+} C", calibration.offset_C);
    const PlatinumCoefficients& sensor = *calibration.certificate;
    const std::string number =
        calibration.certificate_number.empty() ? std::string() : " " + calibration.certificate_number;
    return fmt::format("certificate{}: R0 {} ohm, A {}, B {}, C {}", number, sensor.R0_ohm, sensor.A,
                       sensor.B, sensor.C);
}

}  // namespace thermbal
