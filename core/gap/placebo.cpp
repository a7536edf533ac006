#include "placebo.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include "heat_response.hpp"
#include "network/effect.hpp"
#include "pooling.hpp"

namespace thermbal {
namespace {

constexpr int hats = 40;

struct Hats {
    std::vector<double> middle_s;
    double half_width_s = 1.0;
};

Hats hats_over(const Observation& seen) {
    Hats result;
    const double begin_s = seen.time_s.front();
    result.half_width_s = (seen.time_s.back() - begin_s) / (hats - 1);
    for (int k = 0; k < hats; ++k) result.middle_s.push_back(begin_s + k * result.half_width_s);
    return result;
}

/// Whitened responses of the readings to every hat of heat in a node; empty when the node cannot be
/// simulated.
Eigen::MatrixXd heat_responses(const std::string& node, const FitProblem& problem, const Fit& fit,
                               const Hats& hat) {
    const FitData& data = problem.data();
    const auto step = answer_to_heat(problem, fit, node);
    if (!step) return {};
    // Differences of the answer to a ramp are the answers to hats.
    const CourseOfReadings ramp = step->integrated();
    Eigen::MatrixXd responses(data.seen.reading_C.size(), hats);
    Eigen::MatrixXd one(data.seen.reading_C.rows(), data.seen.reading_C.cols());
    const double begin_s = data.seen.time_s.front(), h = hat.half_width_s;
    for (int k = 0; k < hats; ++k) {
        for (Eigen::Index row = 0; row < one.rows(); ++row) {
            const double since_s = data.seen.time_s[static_cast<std::size_t>(row)] - begin_s - k * h;
            one.row(row) = (ramp.at(since_s + h) - 2.0 * ramp.at(since_s) + ramp.at(since_s - h)) / h;
        }
        if (k == 0) {  // nothing was before the beginning: the half hat is one step less its rising half
            for (Eigen::Index row = 0; row < one.rows(); ++row) {
                const double since_s = data.seen.time_s[static_cast<std::size_t>(row)] - begin_s;
                const double dt = 1e-3 * h;
                one.row(row) = (ramp.at(since_s + dt) - ramp.at(since_s)) / dt -
                               (ramp.at(since_s) - ramp.at(since_s - h)) / h;
            }
        }
        responses.col(k) = data.whitening(one);
    }
    return pooled(responses, one.rows());
}

Eigen::MatrixXd sensor_responses(Eigen::Index column, const FitProblem& problem, const Hats& hat) {
    const FitData& data = problem.data();
    Eigen::MatrixXd responses(data.seen.reading_C.size(), hats);
    for (int k = 0; k < hats; ++k) {
        Eigen::MatrixXd one = Eigen::MatrixXd::Zero(data.seen.reading_C.rows(), data.seen.reading_C.cols());
        for (Eigen::Index row = 0; row < one.rows(); ++row) {
            const double away_s = std::abs(data.seen.time_s[static_cast<std::size_t>(row)] -
                                           hat.middle_s[static_cast<std::size_t>(k)]);
            one(row, column) = std::max(0.0, 1.0 - away_s / hat.half_width_s);
        }
        responses.col(k) = data.whitening(one);
    }
    return pooled(responses, data.seen.reading_C.rows());
}

Eigen::MatrixXd smooth_covariance(const Hats& hat, double size, double smoothness_s) {
    Eigen::MatrixXd covariance(hats, hats);
    for (int i = 0; i < hats; ++i) {
        for (int j = 0; j < hats; ++j) {
            const double apart = std::abs(hat.middle_s[static_cast<std::size_t>(i)] -
                                          hat.middle_s[static_cast<std::size_t>(j)]);
            covariance(i, j) = size * size * std::exp(-apart / smoothness_s);
        }
    }
    return covariance;
}

/// Averages the evidence over sizes and smoothnesses; keeps the course of the best.
void weigh(Nameless& nameless, const Eigen::MatrixXd& responses, const Linearisation& linearisation,
           const Hats& hat, double typical_size) {
    const Eigen::MatrixXd projected = linearisation.project(responses);
    const Eigen::MatrixXd information = responses.transpose() * projected;
    const Eigen::VectorXd score = responses.transpose() * linearisation.residual();
    const double length_s = hat.middle_s.back() - hat.middle_s.front();
    double best = -1e300, sum = 0.0;
    int count = 0;
    std::vector<double> factors;
    for (const double size : {0.03, 0.12, 0.5}) {
        for (const double smoothness : {0.05, 0.3, 2.0}) {
            const Eigen::MatrixXd prior = smooth_covariance(hat, size * typical_size, smoothness * length_s);
            const Eigen::MatrixXd factor = prior.llt().matrixL();
            const Eigen::MatrixXd inner =
                Eigen::MatrixXd::Identity(hats, hats) + factor.transpose() * information * factor;
            const Eigen::LLT<Eigen::MatrixXd> solver(inner);
            const Eigen::VectorXd whitened = factor.transpose() * score;
            const Eigen::VectorXd weights = solver.solve(whitened);
            const Eigen::MatrixXd lower = solver.matrixL();
            const double log_factor = 0.5 * whitened.dot(weights) - lower.diagonal().array().log().sum();
            factors.push_back(log_factor);
            ++count;
            if (log_factor <= best) continue;
            best = log_factor;
            nameless.course = factor * weights;
            nameless.sigma = (factor * solver.solve(factor.transpose())).diagonal().cwiseMax(0.0).cwiseSqrt();
        }
    }
    for (const double log_factor : factors) sum += std::exp(log_factor - best);
    nameless.log_bayes_factor = best + std::log(sum / count);
    nameless.time_s = hat.middle_s;
}

}  // namespace

double Nameless::strongest() const {
    return (course.array().abs() / sigma.array().max(1e-12)).maxCoeff();
}

std::pair<double, double> Nameless::window_s() const {
    double from_s = time_s.back(), to_s = time_s.front();
    for (Eigen::Index k = 0; k < course.size(); ++k) {
        if (std::abs(course(k)) < 2.0 * sigma(k)) continue;
        from_s = std::min(from_s, time_s[static_cast<std::size_t>(k)]);
        to_s = std::max(to_s, time_s[static_cast<std::size_t>(k)]);
    }
    return from_s > to_s ? std::pair(time_s.front(), time_s.back()) : std::pair(from_s, to_s);
}

std::vector<Nameless> nameless_explanations(const FitProblem& problem, const Fit& fit) {
    const Observation& seen = problem.data().seen;
    const Fit fewer = with_pooled_readings(fit);
    const Linearisation linearisation(fewer);
    const Hats hat = hats_over(seen);
    std::vector<Nameless> all;
    const EffectDefinition& steady = *find_effect("motor_heat");
    const double typical_W = resolve_prior(steady.forms.front().parameters.front(), fit.model).centre;
    for (const Node& node : fit.model.nodes) {
        const Eigen::MatrixXd responses = heat_responses(node.name, problem, fit, hat);
        if (responses.size() == 0) continue;
        all.push_back({false, node.name, 0.0, {}, {}, {}});
        weigh(all.back(), responses, linearisation, hat, typical_W);
    }
    for (std::size_t column = 0; column < seen.columns(); ++column) {
        const auto k = static_cast<Eigen::Index>(column);
        all.push_back({true, seen.channels[column], 0.0, {}, {}, {}});
        weigh(all.back(), sensor_responses(k, problem, hat), linearisation, hat,
              std::max(seen.range_C(k), 1.0));
    }
    std::ranges::sort(all, std::ranges::greater{}, &Nameless::log_bayes_factor);
    return all;
}

}  // namespace thermbal
