#include "gibbs.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include "random.hpp"

namespace thermbal {

namespace {

constexpr double level_prior_variance = 1e4;

/// One channel's observation rows, with the gain of the response to the room as one more row.
struct Observed {
    Eigen::MatrixXd rows;
    Eigen::VectorXd value;
    Eigen::VectorXd variance;
    double expected_scale_squared = 1.0;
};

Observed observe(const ReducedChannel& channel, const Basis& basis, double ambient_gain_sd) {
    const Eigen::Index count = channel.rotated.size();
    const Eigen::Index extra = basis.has_ambient ? 1 : 0;
    Observed observed;
    observed.rows = Eigen::MatrixXd::Zero(count + extra, basis.size());
    observed.value = Eigen::VectorXd::Zero(count + extra);
    observed.variance =
        Eigen::VectorXd::Constant(count + extra, channel.sample_variance * channel.variance_inflation);
    observed.rows.topRows(count) = channel.reduced;
    observed.value.head(count) = channel.rotated;
    if (basis.has_ambient) {
        observed.rows.row(count).tail(basis.grid()).setOnes();
        observed.value[count] = 1.0;
        observed.variance[count] = ambient_gain_sd * ambient_gain_sd;
    }
    observed.expected_scale_squared = channel.range_C * channel.range_C + 9.0 * channel.sample_variance;
    return observed;
}

struct Posterior {
    Eigen::VectorXd mean;
    Eigen::VectorXd draw;
    double functional_mean = 0.0;
    double functional_variance = 0.0;
};

/// Gaussian posterior of the coefficients given their prior, with one draw by Matheron's rule (a prior draw,
/// corrected by what it misses of a simulated observation): exact, and only as large as the rows that carry
/// information.
Posterior condition(const Observed& observed, const Eigen::VectorXd& prior_mean,
                    const Eigen::VectorXd& prior_variance, const Eigen::VectorXd& functional,
                    Random& random) {
    const Eigen::MatrixXd gain = prior_variance.asDiagonal() * observed.rows.transpose();
    Eigen::MatrixXd covariance = observed.rows * gain;
    covariance.diagonal() += observed.variance;
    const Eigen::LLT<Eigen::MatrixXd> factor(covariance);
    Posterior posterior;
    posterior.mean = prior_mean + gain * factor.solve(observed.value - observed.rows * prior_mean);
    Eigen::VectorXd draw(prior_mean.size());
    for (Eigen::Index k = 0; k < draw.size(); ++k) {
        draw[k] = prior_mean[k] + std::sqrt(prior_variance[k]) * random.normal();
    }
    Eigen::VectorXd missed = observed.value - observed.rows * draw;
    for (Eigen::Index k = 0; k < missed.size(); ++k)
        missed[k] -= std::sqrt(observed.variance[k]) * random.normal();
    posterior.draw = draw + gain * factor.solve(missed);
    const Eigen::VectorXd projected = factor.matrixL().solve(gain.transpose() * functional);
    posterior.functional_mean = functional.dot(posterior.mean);
    posterior.functional_variance =
        std::max(0.0, functional.cwiseAbs2().dot(prior_variance) - projected.squaredNorm());
    return posterior;
}

double median(std::vector<double> values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

double inverse_gamma(double shape, double rate, Random& random) {
    return rate / random.gamma(shape);
}

}  // namespace

SpectrumDraws sample_spectrum(const std::vector<ReducedChannel>& channels, const Basis& basis,
                              const Eigen::VectorXd& steady_state, const WeightPrior& prior,
                              std::size_t burn_in, std::size_t draws, std::size_t kept_coefficients,
                              std::uint64_t seed) {
    Random random(seed);
    const Eigen::Index grid = basis.grid();
    std::vector<Observed> observed;
    std::vector<double> ranges;
    for (const ReducedChannel& channel : channels) {
        observed.push_back(observe(channel, basis, prior.ambient_gain_sd));
        ranges.push_back(channel.range_C);
    }
    // A sensor far from the heat is flat at first because its modes cancel, not because they are small.
    const double common = prior.scale_floor * median(ranges);
    for (Observed& each : observed) each.expected_scale_squared += common * common;

    double level = prior.level_shape / prior.level_rate;
    Eigen::VectorXd weight = prior.fixed_rate + level * prior.level_profile;
    Eigen::VectorXd scale_squared(static_cast<Eigen::Index>(channels.size()));
    for (std::size_t i = 0; i < channels.size(); ++i) {
        scale_squared[static_cast<Eigen::Index>(i)] = observed[i].expected_scale_squared;
    }

    SpectrumDraws result;
    result.channels.resize(channels.size());
    for (ChannelDraws& channel : result.channels) {
        channel.coefficient_mean = Eigen::VectorXd::Zero(basis.size());
        channel.coefficients =
            Eigen::MatrixXd::Zero(basis.size(), static_cast<Eigen::Index>(kept_coefficients));
    }
    result.log_weight_mean = Eigen::VectorXd::Zero(grid);
    result.log_weight_sd = Eigen::VectorXd::Zero(grid);

    Eigen::VectorXd prior_mean = Eigen::VectorXd::Zero(basis.size());
    Eigen::VectorXd prior_variance(basis.size());
    prior_variance[0] = level_prior_variance;
    if (basis.has_ambient) {
        prior_mean.tail(grid) = prior.ambient_mean;
        prior_variance.tail(grid) = prior.ambient_variance;
    }

    for (std::size_t sweep = 0; sweep < burn_in + draws; ++sweep) {
        const bool keep = sweep >= burn_in;
        Eigen::VectorXd energy = Eigen::VectorXd::Zero(grid);
        for (std::size_t i = 0; i < channels.size(); ++i) {
            double& scale = scale_squared[static_cast<Eigen::Index>(i)];
            prior_variance.segment(1, grid) = scale * weight;
            const Posterior posterior =
                condition(observed[i], prior_mean, prior_variance, steady_state, random);
            const Eigen::VectorXd squares = posterior.draw.segment(1, grid).cwiseAbs2();
            scale = inverse_gamma(prior.scale_shape + 0.5 * static_cast<double>(grid),
                                  prior.scale_shape * observed[i].expected_scale_squared +
                                      0.5 * squares.cwiseQuotient(weight).sum(),
                                  random);
            energy += squares / scale;
            if (!keep) continue;
            ChannelDraws& channel = result.channels[i];
            channel.mean.push_back(posterior.functional_mean);
            channel.variance.push_back(posterior.functional_variance);
            channel.coefficient_mean += posterior.mean / static_cast<double>(draws);
            const std::size_t kept = sweep - burn_in;
            const std::size_t every = std::max<std::size_t>(1, draws / kept_coefficients);
            if (kept % every == 0 && kept / every < kept_coefficients) {
                channel.coefficients.col(static_cast<Eigen::Index>(kept / every)) = posterior.draw;
            }
        }
        double level_rate = prior.level_rate;
        double level_shape = prior.level_shape;
        for (Eigen::Index j = 0; j < grid; ++j) {
            const double shape = prior.shape[j] + 0.5 * static_cast<double>(channels.size());
            const double rate = prior.fixed_rate[j] + level * prior.level_profile[j] + 0.5 * energy[j];
            weight[j] = inverse_gamma(shape, rate, random);
            if (prior.level_profile[j] <= 0.0) continue;
            level_shape += prior.shape[j];
            level_rate += prior.level_profile[j] / weight[j];
        }
        level = random.gamma(level_shape) / level_rate;
        if (!keep) continue;
        const Eigen::VectorXd log_weight = weight.array().log();
        result.log_weight_mean += log_weight / static_cast<double>(draws);
        result.log_weight_sd += log_weight.cwiseAbs2() / static_cast<double>(draws);
    }
    result.log_weight_sd =
        (result.log_weight_sd - result.log_weight_mean.cwiseAbs2()).cwiseMax(0.0).cwiseSqrt();
    return result;
}

}  // namespace thermbal
