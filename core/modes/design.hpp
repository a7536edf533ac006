#pragma once

#include <cstddef>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "modes/spectrum.hpp"

namespace thermbal {

/// The room as the machine feels it: deviation from its level at the window's start, gaps bridged linearly.
struct AmbientInput {
    bool measured = false;
    double reference_C = 0.0;
    double tail_C = 0.0;
    std::vector<double> deviation_C;  ///< one a scan

    double range_C() const;  ///< between the 2 % and the 98 % quantile
};

AmbientInput ambient_input(const TestWindow& window, std::string_view ambient, double tail_min);

/// The window with isolated outliers taken out (NaN): samples further from the median of their neighbours
/// than the scatter of the channel, and of the place, explains (Hampel's identifier).
TestWindow without_spikes(const TestWindow& window);

/// Basis columns: level, one step response a time constant, and with an ambient its deviation passed through
/// a first-order lag of every time constant.
struct Basis {
    std::vector<double> time_constant_min;
    bool has_ambient = false;

    Eigen::Index grid() const { return static_cast<Eigen::Index>(time_constant_min.size()); }
    Eigen::Index size() const { return 1 + grid() * (has_ambient ? 2 : 1); }
};

std::vector<double> logarithmic_grid(double first, double last, std::size_t points);

/// Rows are blocks of scans (means over the scans of a block), columns the basis.
Eigen::MatrixXd block_design(const Basis& basis, const TestWindow& window, const AmbientInput& ambient,
                             std::size_t scans_per_block);

/// The step columns alone: 1 - exp(-t / tau), one column a time constant, means over blocks.
Eigen::MatrixXd block_steps(const std::vector<double>& time_constant_min, const TestWindow& window,
                            std::size_t scans_per_block);

/// Rows are the times of `after_min` (minutes after the window's last scan) with the ambient held at its tail
/// mean.
Eigen::MatrixXd future_design(const Basis& basis, const TestWindow& window, const AmbientInput& ambient,
                              const std::vector<double>& after_min);

/// Means over blocks of scans, less the mean of all samples; where a block has no good sample count and mean
/// are 0.
struct BlockMeans {
    Eigen::VectorXd mean;
    Eigen::VectorXd count;
    double within_sum = 0.0;  ///< squared deviations of samples from their block's mean
    double centre_C = 0.0;
    std::size_t good = 0;
};

BlockMeans block_means(const std::vector<double>& values, Eigen::Index rows, std::size_t scans_per_block);

/// What one channel's samples say about the coefficients, in as few rows as carry information:
/// rotated = reduced * coefficients + N(0, row_variance).
struct ReducedChannel {
    Eigen::MatrixXd reduced;
    Eigen::MatrixXd reduced_fine;  ///< the same rotation of the fine grid's step columns
    Eigen::VectorXd rotated;
    double centre_C = 0.0;            ///< taken off the samples before; add to the level
    double sample_variance = 0.0;     ///< of one sample about the best fit, floored by the resolution
    double variance_inflation = 1.0;  ///< integrated autocorrelation of the residuals
    double residual_rms_C = 0.0;      ///< of block means
    double change_C = 0.0;            ///< last block means less first
    double range_C = 0.0;             ///< of block means, first to last tenth and extremes
    double resolution_C = 0.0;
    std::size_t good_samples = 0;
};

/// Channels with the same samples missing share one decomposition.
std::vector<ReducedChannel> reduce_channels(const Eigen::MatrixXd& design, const Eigen::MatrixXd& fine,
                                            const TestWindow& window,
                                            const std::vector<std::size_t>& channels,
                                            std::size_t scans_per_block);

}  // namespace thermbal
