#include "channel_model.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

namespace thermbal {

Eigen::MatrixXd response_rows(const ReducedChannel& channel, const Basis& basis,
                              const Eigen::MatrixXd& responses) {
    return channel.reduced.middleCols(1, basis.grid()) * responses.topRows(basis.grid()) +
           channel.reduced_fine * responses.bottomRows(channel.reduced_fine.cols());
}

ChannelModel::ChannelModel(const ReducedChannel& channel, const Basis& basis, const BackgroundPrior& prior,
                           double scale, double mode_scale, const Eigen::VectorXd& functional)
    : scale_squared_(mode_scale * mode_scale) {
    constexpr double free_scale = 10.0;
    const Eigen::Index count = channel.rotated.size();
    const Eigen::Index extra = basis.has_ambient ? 1 : 0;
    const Eigen::Index responses = prior.responses.cols();
    const Eigen::Index columns = basis.size() + responses;
    rows_ = Eigen::MatrixXd::Zero(count + extra, columns);
    rows_.topLeftCorner(count, basis.size()) = channel.reduced;
    functional_ = Eigen::VectorXd::Zero(columns);
    functional_.head(basis.size()) = functional;
    fine_ = Eigen::MatrixXd::Zero(count + extra, channel.reduced_fine.cols());
    fine_.topRows(count) = channel.reduced_fine;
    if (responses > 0) {
        rows_.block(0, basis.size(), count, responses) = response_rows(channel, basis, prior.responses);
        functional_.tail(responses) = prior.responses.colwise().sum().transpose();
    }
    value_ = Eigen::VectorXd::Zero(count + extra);
    value_.head(count) = channel.rotated;
    noise_variance_ =
        Eigen::VectorXd::Constant(count + extra, channel.sample_variance * channel.variance_inflation);
    prior_mean_ = Eigen::VectorXd::Zero(columns);
    prior_variance_ = Eigen::VectorXd::Zero(columns);
    for (Eigen::Index k = 0; k < responses; ++k) {
        const double sd = (k == 0 ? free_scale : 1.0) * scale;
        prior_variance_[basis.size() + k] = sd * sd;
    }
    const double reach = 10.0 * (channel.range_C + 1.0);
    prior_variance_[0] = reach * reach;
    prior_variance_.segment(1, basis.grid()) = scale_squared_ * prior.level_profile;
    if (basis.has_ambient) {
        // In the end the channel follows the room: the gains' sum is one more observation.
        rows_.row(count).segment(1 + basis.grid(), basis.grid()).setOnes();
        const double relative = prior.ambient_gain_loss_per_C * channel.range_C;
        const double loss = relative / (1.0 + relative);
        value_[count] = 1.0 - loss;
        noise_variance_[count] = prior.ambient_gain_sd * prior.ambient_gain_sd + loss * loss;
        prior_mean_.segment(1 + basis.grid(), basis.grid()) = prior.ambient_mean;
        prior_variance_.segment(1 + basis.grid(), basis.grid()) = prior.ambient_variance;
    }
    background_covariance_ = rows_ * prior_variance_.asDiagonal() * rows_.transpose();
    background_covariance_.diagonal() += noise_variance_;
    cross_ = rows_ * prior_variance_.cwiseProduct(functional_);
    functional_variance_ = functional_.cwiseAbs2().dot(prior_variance_);
    functional_mean_ = functional_.dot(prior_mean_);
    value_ -= rows_ * prior_mean_;
}

WhitenedChannel ChannelModel::whitened(double direction) const {
    const Eigen::LLT<Eigen::MatrixXd> factor(background_covariance_);
    const Eigen::MatrixXd columns = factor.matrixL().solve(fine_);
    WhitenedChannel whitened;
    whitened.gram = columns.transpose() * columns;
    whitened.projected = columns.transpose() * factor.matrixL().solve(value_);
    whitened.scale = std::sqrt(scale_squared_);
    whitened.direction = direction;
    return whitened;
}

Eigen::MatrixXd ChannelModel::columns_at(const std::vector<Mode>& modes) const {
    Eigen::MatrixXd columns(fine_.rows(), static_cast<Eigen::Index>(modes.size()));
    for (std::size_t k = 0; k < modes.size(); ++k) {
        const GridCell cell = cell_of(modes[k].position, fine_.cols());
        columns.col(static_cast<Eigen::Index>(k)) =
            (1.0 - cell.share) * fine_.col(cell.below) + cell.share * fine_.col(cell.below + 1);
    }
    return columns;
}

void ChannelModel::condition_on(const Eigen::MatrixXd& columns, const ModeAmplitudes& amplitudes) {
    columns_ = columns;
    mode_variance_ = scale_squared_ * amplitudes.variance;
    mode_mean_ = std::sqrt(scale_squared_) * amplitudes.mean;
    left_ = value_ - columns_ * mode_mean_;
    Eigen::MatrixXd covariance = background_covariance_;
    covariance.noalias() += columns_ * mode_variance_.asDiagonal() * columns_.transpose();
    const Eigen::LLT<Eigen::MatrixXd> factor(covariance);
    factor_ = factor.matrixL();
    dual_ = factor.solve(left_);
}

ConditionalValue ChannelModel::steady_state() const {
    const Eigen::VectorXd cross = cross_ + columns_ * mode_variance_;
    const Eigen::VectorXd half = factor_.triangularView<Eigen::Lower>().solve(cross);
    const double prior_variance = functional_variance_ + mode_variance_.sum();
    return {functional_mean_ + mode_mean_.sum() + cross.dot(dual_),
            std::max(0.0, prior_variance - half.squaredNorm())};
}

double ChannelModel::settled(const Eigen::VectorXd& sample) const {
    return functional_.dot(sample.head(functional_.size())) +
           sample.tail(sample.size() - functional_.size()).sum();
}

Eigen::VectorXd ChannelModel::mean_background() const {
    return prior_mean_ + prior_variance_.cwiseProduct(rows_.transpose() * dual_);
}

Eigen::VectorXd ChannelModel::mean_modes() const {
    return mode_mean_ + mode_variance_.cwiseProduct(columns_.transpose() * dual_);
}

Eigen::VectorXd ChannelModel::draw(Random& random) const {
    const Eigen::Index basis = rows_.cols();
    const Eigen::Index modes = columns_.cols();
    Eigen::VectorXd sample(basis + modes);
    for (Eigen::Index k = 0; k < basis; ++k) sample[k] = std::sqrt(prior_variance_[k]) * random.normal();
    for (Eigen::Index k = 0; k < modes; ++k)
        sample[basis + k] = std::sqrt(mode_variance_[k]) * random.normal();
    Eigen::VectorXd missed = left_ - rows_ * sample.head(basis) - columns_ * sample.tail(modes);
    for (Eigen::Index k = 0; k < missed.size(); ++k)
        missed[k] -= std::sqrt(noise_variance_[k]) * random.normal();
    const Eigen::VectorXd half = factor_.triangularView<Eigen::Lower>().solve(missed);
    const Eigen::VectorXd dual = factor_.triangularView<Eigen::Lower>().transpose().solve(half);
    sample.head(basis) += prior_variance_.cwiseProduct(rows_.transpose() * dual) + prior_mean_;
    sample.tail(modes) += mode_variance_.cwiseProduct(columns_.transpose() * dual) + mode_mean_;
    return sample;
}

}  // namespace thermbal
