#include "kalman_prediction.hpp"

#include "modes/kalman.hpp"

namespace thermbal {

KalmanPrediction kalman_prediction(std::span<const double> samples_C, const TestWindow& window) {
    constexpr double sds_of_90_percent = 1.645;
    KalmanOptions options;
    options.period_s = window.period_s;
    const AdaptiveUnscentedKalman filter = kalman_after(samples_C, options);
    if (!filter.started()) return {};
    const double half_C = sds_of_90_percent * filter.steady_state_sd_C();
    return {filter.steady_state_C(), filter.steady_state_C() - half_C, filter.steady_state_C() + half_C,
            filter.equilibrium_time_min() + window.start_s / 60.0};
}

}  // namespace thermbal
