#include "mode.hpp"

#include <algorithm>
#include <cmath>

namespace thermbal {

GridCell cell_of(double position, Eigen::Index points) {
    const auto below = std::min(static_cast<Eigen::Index>(position), points - 2);
    return {below, position - static_cast<double>(below)};
}

double interpolate(const Eigen::VectorXd& values, double position) {
    const GridCell cell = cell_of(position, values.size());
    return (1.0 - cell.share) * values[cell.below] + cell.share * values[cell.below + 1];
}

ModeAmplitudes relative_amplitudes(const std::vector<Mode>& modes, const ModePrior& prior, double direction) {
    ModeAmplitudes amplitudes;
    amplitudes.variance.resize(static_cast<Eigen::Index>(modes.size()));
    amplitudes.mean.resize(static_cast<Eigen::Index>(modes.size()));
    for (std::size_t k = 0; k < modes.size(); ++k) {
        const auto index = static_cast<Eigen::Index>(k);
        const double share = interpolate(prior.same_sign, modes[k].position) * std::abs(direction);
        amplitudes.variance[index] = std::exp(modes[k].log_variance) * (1.0 - share * share);
        amplitudes.mean[index] = std::exp(0.5 * modes[k].log_variance) * std::copysign(share, direction);
    }
    return amplitudes;
}

}  // namespace thermbal
