#pragma once

#include <optional>
#include <string>

namespace thermbal {

/// Callendar-Van Dusen: R(t) = R0 (1 + A t + B t^2) from 0 C on, and R0 (1 + A t + B t^2 + C (t - 100) t^3)
/// below. The defaults are those of IEC 60751:2022, 4.2, which every PT100 module computes with.
struct PlatinumCoefficients {
    double R0_ohm = 100.0;
    double A = 3.9083e-3;   ///< 1/C
    double B = -5.775e-7;   ///< 1/C^2
    double C = -4.183e-12;  ///< 1/C^4
};

/// Range of IEC 60751: outside of it neither function below promises anything.
inline constexpr double platinum_low_C = -200.0;
inline constexpr double platinum_high_C = 850.0;

double resistance_ohm(const PlatinumCoefficients& sensor, double temperature_C);

/// The inverse, within 1e-9 C of the platinum range; NaN for a resistance that no temperature from -250 to
/// 1000 C has.
double temperature_C(const PlatinumCoefficients& sensor, double resistance_ohm);

/// One sentence that names the coefficient, what was found and what is accepted; empty when they can be those
/// of a platinum sensor of 100, 500 or 1000 ohm.
std::string check_coefficients(const PlatinumCoefficients& sensor);

/// What a channel's certificate says: an offset, or the sensor's own coefficients.
struct Calibration {
    double offset_C = 0.0;                            ///< added to the reading
    std::optional<PlatinumCoefficients> certificate;  ///< instead of offset_C
    std::string certificate_number;

    bool none() const { return offset_C == 0.0 && !certificate; }
};

/// The temperature of the sensor, when a module that takes it for one of IEC 60751 says source_C: that
/// standard gives back the resistance that the module has measured, the certificate its temperature. NaN
/// outside of the platinum range.
double calibrated_C(const Calibration& calibration, double source_C);

/// "offset +0.12 C", "certificate K-2231: R0 100.012 ohm, ..."; empty for none.
std::string describe(const Calibration& calibration);

}  // namespace thermbal
