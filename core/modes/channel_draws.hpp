#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "spectrum_problem.hpp"

namespace thermbal {

/// Minutes at which curves are drawn: the window's blocks, then a geometric grid beyond its end.
struct CurveGrid {
    std::vector<double> minute;  ///< since the window's start
    Eigen::MatrixXd design;      ///< of the basis
    Eigen::MatrixXd fine;        ///< step columns of the modes' grid
};

CurveGrid curve_grid(const SpectrumProblem& problem);

/// 1 - exp(-minute / tau), one column a time constant.
Eigen::MatrixXd step_columns(const std::vector<double>& time_constant_min, const std::vector<double>& minute);

/// First minute at which the curve has done 95 % of its way from `start` to `settled`.
double crossing_time(const std::vector<double>& minute, const Eigen::VectorXd& curve, double start,
                     double settled);

double sorted_quantile(std::vector<double> values, double probability);

/// A channel as the sampling leaves it: its steady state an equal mixture of normals (less the channel's
/// centre), mean coefficients, and draws of its curve.
struct ChannelDraws {
    std::vector<double> mean;
    std::vector<double> variance;
    Eigen::VectorXd background;           ///< posterior mean: basis, then archived responses
    Eigen::VectorXd fine;                 ///< posterior mean amplitudes on the modes' grid
    std::vector<double> equilibrium_min;  ///< since the start of the test

    /// Mean and standard deviation of the mixture; half of the width between its 5 % and 95 % quantiles.
    double steady_state() const;
    double standard_deviation() const;
    double half_width_of_90_percent() const;
};

/// What is linear whatever the modes are, archived responses spread over the basis and the modes' grid.
struct BackgroundAmplitudes {
    Eigen::VectorXd of_basis;
    Eigen::VectorXd of_modes;  ///< empty without archived responses
};

/// `background`: coefficients of the basis, then of the channel's archived responses.
BackgroundAmplitudes spread_responses(const ObservedChannel& channel, const Basis& basis,
                                      const Eigen::VectorXd& background);

/// A value a minute of the grid.
Eigen::VectorXd background_curve(const BackgroundAmplitudes& amplitudes, const CurveGrid& curves);

/// What the states say of each channel, and of the modes themselves.
struct SpectrumDraws {
    std::vector<ChannelDraws> channels;
    std::vector<double> mode_energy;  ///< one a state: summed relative variances
    Eigen::VectorXd density;          ///< expected number of modes in each cell of the fine grid
    Eigen::VectorXd log_variance;     ///< mean log relative variance there; the prior's where there is none
};

SpectrumDraws draw_channels(const SpectrumProblem& problem, std::vector<ChannelModel>& models,
                            const std::vector<std::vector<Mode>>& states, const CurveGrid& curves,
                            std::uint64_t seed);

}  // namespace thermbal
