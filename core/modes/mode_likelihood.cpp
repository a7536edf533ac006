#include "mode_likelihood.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "base/every_width.hpp"

namespace thermbal {

namespace {

constexpr std::size_t lanes = ChannelGroup::lanes;
constexpr std::size_t room_for_modes = ModeLikelihood::most_modes;

/// One number a channel, as many at a time as the widest registers hold.
using EightChannels [[gnu::vector_size(64)]] = double;
constexpr std::size_t eights = lanes * sizeof(double) / sizeof(EightChannels);
using EachChannel = std::array<EightChannels, eights>;

[[gnu::always_inline]] inline EachChannel load(const double* from) {
    EachChannel loaded;
    std::memcpy(loaded.data(), from, sizeof loaded);
    return loaded;
}

/// What the modes have in common on all channels.
struct ModeTerms {
    std::size_t count = 0;
    std::array<std::size_t, room_for_modes> below{};
    std::array<double, room_for_modes> share{};
    std::array<double, room_for_modes> variance{};  ///< relative to a channel's squared scale
    std::array<double, room_for_modes> mean{};      ///< relative to its scale
};

struct Sums {
    std::array<double, lanes> of_mean{};
    std::array<double, lanes> fitted{};
    std::array<double, lanes> log_determinant{};
};

/// A few pivots share a logarithm. A missing channel's are taken along: nobody reads them.
void take_logarithms(std::array<double, lanes>& determinant, std::array<double, lanes>& log_determinant) {
    for (std::size_t lane = 0; lane < lanes; ++lane) {
        if (determinant[lane] <= 1e200 && determinant[lane] >= 1e-200) continue;
        log_determinant[lane] += std::log(determinant[lane]);
        determinant[lane] = 1.0;
    }
}

/// With the columns U and the data z of a channel whitened, A the variances of the modes' amplitudes and m
/// their means: L L' = U'U + A^-1 gives log |I + U A U'| and the quadratic form by Woodbury's identity.
THERMBAL_EVERY_WIDTH
void add_up(const ModeTerms& modes, const ChannelGroup& channels, Sums& sums) {
    const std::size_t count = modes.count;
    std::array<std::array<EachChannel, room_for_modes>, room_for_modes> factor;
    std::array<EachChannel, room_for_modes> expected;
    std::array<EachChannel, room_for_modes> projected;
    std::array<EachChannel, room_for_modes> solved;
    const EachChannel scale = load(channels.scale.data());
    for (std::size_t row = 0; row < count; ++row) {
        const double share = modes.share[row];
        const EachChannel at_below = load(channels.projected.data() + modes.below[row] * lanes);
        const EachChannel at_next = load(channels.projected.data() + (modes.below[row] + 1) * lanes);
        for (std::size_t e = 0; e < eights; ++e) {
            projected[row][e] = (1.0 - share) * at_below[e] + share * at_next[e];
            expected[row][e] = scale[e] * modes.mean[row];
        }
    }
    // Of the data less what the means explain: their own misfit here, the modes' gain below.
    std::array<EachChannel, room_for_modes> left = projected;
    for (std::size_t row = 0; row < count; ++row) {
        for (std::size_t column = 0; column <= row; ++column) {
            const double of_row = modes.share[row];
            const double of_column = modes.share[column];
            const double* const corner =
                channels.gram.data() + (modes.below[row] * channels.points + modes.below[column]) * lanes;
            const EachChannel first_below = load(corner);
            const EachChannel first_next = load(corner + lanes);
            const EachChannel second_below = load(corner + channels.points * lanes);
            const EachChannel second_next = load(corner + (channels.points + 1) * lanes);
            for (std::size_t e = 0; e < eights; ++e) {
                const EightChannels first = (1.0 - of_column) * first_below[e] + of_column * first_next[e];
                const EightChannels second = (1.0 - of_column) * second_below[e] + of_column * second_next[e];
                const EightChannels value = (1.0 - of_row) * first + of_row * second;
                factor[row][column][e] = value;
                left[row][e] -= value * expected[column][e];
                if (column < row) left[column][e] -= value * expected[row][e];
            }
        }
    }
    EachChannel of_mean{};
    for (std::size_t row = 0; row < count; ++row) {
        for (std::size_t e = 0; e < eights; ++e) {
            of_mean[e] += expected[row][e] * (projected[row][e] + left[row][e]);
        }
    }
    std::array<double, lanes> determinant;
    determinant.fill(1.0);
    EachChannel fitted{};
    for (std::size_t row = 0; row < count; ++row) {
        for (std::size_t column = 0; column < row; ++column) {
            EachChannel value = factor[row][column];
            for (std::size_t k = 0; k < column; ++k) {
                for (std::size_t e = 0; e < eights; ++e) value[e] -= factor[row][k][e] * factor[column][k][e];
            }
            for (std::size_t e = 0; e < eights; ++e) {
                factor[row][column][e] = value[e] / factor[column][column][e];
            }
        }
        EachChannel pivot = factor[row][row];
        EachChannel value = left[row];
        for (std::size_t e = 0; e < eights; ++e)
            pivot[e] += 1.0 / (scale[e] * scale[e] * modes.variance[row]);
        for (std::size_t k = 0; k < row; ++k) {
            for (std::size_t e = 0; e < eights; ++e) {
                pivot[e] -= factor[row][k][e] * factor[row][k][e];
                value[e] -= factor[row][k][e] * solved[k][e];
            }
        }
        std::array<double, lanes> of_lane;
        std::memcpy(of_lane.data(), pivot.data(), sizeof of_lane);
        for (std::size_t lane = 0; lane < lanes; ++lane) {
            of_lane[lane] = std::max(of_lane[lane], 1e-12);
            determinant[lane] *= of_lane[lane];
            of_lane[lane] = std::sqrt(of_lane[lane]);
        }
        take_logarithms(determinant, sums.log_determinant);
        factor[row][row] = load(of_lane.data());
        for (std::size_t e = 0; e < eights; ++e) {
            solved[row][e] = value[e] / factor[row][row][e];
            fitted[e] += solved[row][e] * solved[row][e];
        }
    }
    for (std::size_t lane = 0; lane < lanes; ++lane)
        sums.log_determinant[lane] += std::log(determinant[lane]);
    std::memcpy(sums.of_mean.data(), of_mean.data(), sizeof of_mean);
    std::memcpy(sums.fitted.data(), fitted.data(), sizeof fitted);
}

}  // namespace

ModeLikelihood::ModeLikelihood(const std::vector<WhitenedChannel>& channels, const ModePrior& prior)
    : prior_(prior),
      points_(static_cast<std::size_t>(channels.front().projected.size())),
      direction_(channels.front().direction) {
    for (std::size_t k = 0; k < channels.size(); ++k) {
        const std::size_t lane = k % lanes;
        if (lane == 0) {
            groups_.push_back({0, points_, std::vector<double>(points_ * points_ * lanes, 0.0),
                               std::vector<double>(points_ * lanes, 0.0), std::vector<double>(lanes, 1.0),
                               std::vector<double>(lanes, 0.0)});
        }
        const WhitenedChannel& channel = channels[k];
        ChannelGroup& group = groups_.back();
        ++group.channels;
        for (std::size_t row = 0; row < points_; ++row) {
            const auto i = static_cast<Eigen::Index>(row);
            group.projected[row * lanes + lane] = channel.projected[i];
            for (std::size_t column = 0; column < points_; ++column) {
                group.gram[(row * points_ + column) * lanes + lane] =
                    channel.gram(i, static_cast<Eigen::Index>(column));
            }
        }
        group.scale[lane] = channel.scale;
        group.log_scale_squared[lane] = std::log(channel.scale * channel.scale);
    }
}

double ModeLikelihood::log_at(const std::vector<Mode>& modes) const {
    const ModeAmplitudes amplitudes = relative_amplitudes(modes, prior_, direction_);
    ModeTerms terms;
    terms.count = modes.size();
    double log_variances = 0.0;
    for (std::size_t k = 0; k < modes.size(); ++k) {
        const GridCell cell = cell_of(modes[k].position, static_cast<Eigen::Index>(points_));
        terms.below[k] = static_cast<std::size_t>(cell.below);
        terms.share[k] = cell.share;
        const auto index = static_cast<Eigen::Index>(k);
        terms.variance[k] = amplitudes.variance[index];
        terms.mean[k] = amplitudes.mean[index];
        log_variances += std::log(terms.variance[k]);
    }
    double total = 0.0;
    for (const ChannelGroup& group : groups_) {
        Sums sums;
        add_up(terms, group, sums);
        for (std::size_t lane = 0; lane < group.channels; ++lane) {
            total +=
                0.5 * (sums.of_mean[lane] + sums.fitted[lane] - sums.log_determinant[lane] - log_variances -
                       static_cast<double>(modes.size()) * group.log_scale_squared[lane]);
        }
    }
    return total;
}

}  // namespace thermbal
