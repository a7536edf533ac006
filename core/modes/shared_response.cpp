#include "shared_response.hpp"

#include <algorithm>

#include <Eigen/Cholesky>

namespace thermbal {

namespace {

/// What a channel adds to the normal equations of the mixture: precision * g = information.
struct Evidence {
    Eigen::MatrixXd precision;
    Eigen::VectorXd information;
};

Evidence evidence_of(const RespondingChannel& channel, const Eigen::VectorXd& mixture, double channel_sd) {
    const Eigen::Index count = channel.responses.cols() - 1;
    const Eigen::MatrixXd differences = channel.responses.rightCols(count);
    const Eigen::VectorXd mean = channel.responses.col(0);
    Eigen::MatrixXd covariance = channel.covariance;
    const double own_sd = channel_sd * channel.scale_C;
    covariance.noalias() += own_sd * own_sd * differences * differences.transpose();
    const Eigen::LLT<Eigen::MatrixXd> factor(covariance);
    const Eigen::VectorXd response = mean + differences * mixture;
    const Eigen::VectorXd weighted = factor.solve(response);
    const double norm = std::max(response.dot(weighted), 1e-12);
    const double scale = weighted.dot(channel.value) / norm;
    // The scale is free: what lies along the response says nothing about the mixture.
    const Eigen::MatrixXd columns = scale * differences;
    const Eigen::VectorXd along = columns.transpose() * weighted;
    const Eigen::VectorXd left = channel.value - scale * mean;
    Evidence evidence;
    evidence.precision = columns.transpose() * factor.solve(columns) - along * along.transpose() / norm;
    evidence.information = columns.transpose() * factor.solve(left) - along * (weighted.dot(left) / norm);
    return evidence;
}

}  // namespace

RespondingChannel responding_channel(const ReducedChannel& data, const Basis& basis,
                                     const BackgroundPrior& background, const Eigen::MatrixXd& responses,
                                     double scale_C, double mode_scale_C, const ModePrior& modes) {
    RespondingChannel channel;
    if (responses.cols() == 0) return channel;
    const ChannelModel model(data, basis, background, scale_C, mode_scale_C,
                             Eigen::VectorXd::Zero(basis.size()));
    channel.value = model.value();
    channel.covariance = model.covariance();
    channel.scale_C = scale_C;
    const Eigen::Index rows = data.rotated.size();
    const Eigen::VectorXd variance =
        mode_scale_C * mode_scale_C * modes.intensity.array() * modes.log_variance_mean.array().exp();
    channel.covariance.topLeftCorner(rows, rows) +=
        data.reduced_fine * variance.asDiagonal() * data.reduced_fine.transpose();
    channel.responses = Eigen::MatrixXd::Zero(channel.value.size(), responses.cols());
    channel.responses.topRows(rows) = response_rows(data, basis, responses);
    return channel;
}

std::vector<MixtureBelief> common_mixture(const std::vector<RespondingChannel>& channels,
                                          const MixtureOptions& options) {
    Eigen::Index count = 0;
    for (const RespondingChannel& channel : channels) count = std::max(count, channel.responses.cols() - 1);
    std::vector<MixtureBelief> beliefs(channels.size());
    if (count < 1) return beliefs;
    const Eigen::MatrixXd prior_precision =
        Eigen::MatrixXd::Identity(count, count) / (options.prior_sd * options.prior_sd);
    Eigen::VectorXd mixture = Eigen::VectorXd::Zero(count);
    std::vector<Evidence> evidence(channels.size());
    Eigen::MatrixXd precision;
    Eigen::VectorXd information;
    constexpr int rounds = 6;
    for (int round = 0; round < rounds; ++round) {
        precision = prior_precision;
        information = Eigen::VectorXd::Zero(count);
        for (std::size_t i = 0; i < channels.size(); ++i) {
            if (channels[i].responses.cols() != count + 1) continue;
            evidence[i] = evidence_of(channels[i], mixture, options.channel_sd);
            precision += evidence[i].precision;
            information += evidence[i].information;
        }
        mixture = precision.ldlt().solve(information);
    }
    for (std::size_t i = 0; i < channels.size(); ++i) {
        if (channels[i].responses.cols() != count + 1) continue;
        const Eigen::LDLT<Eigen::MatrixXd> others(precision - evidence[i].precision);
        beliefs[i].mean = others.solve(information - evidence[i].information);
        beliefs[i].covariance = others.solve(Eigen::MatrixXd::Identity(count, count));
        beliefs[i].covariance.diagonal().array() += options.channel_sd * options.channel_sd;
    }
    return beliefs;
}

Eigen::MatrixXd moved_responses(const Eigen::MatrixXd& responses, const MixtureBelief& belief) {
    const Eigen::Index count = responses.cols() - 1;
    if (count < 1 || belief.mean.size() != count) return responses;
    Eigen::MatrixXd moved = responses;
    moved.col(0) += responses.rightCols(count) * belief.mean;
    const Eigen::LLT<Eigen::MatrixXd> factor(belief.covariance);
    moved.rightCols(count) = responses.rightCols(count) * factor.matrixL();
    return moved;
}

}  // namespace thermbal
