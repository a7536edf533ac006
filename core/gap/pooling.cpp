#include "pooling.hpp"

#include <algorithm>
#include <cmath>

namespace thermbal {

using Eigen::Index;

Eigen::MatrixXd pooled(const Eigen::MatrixXd& whitened, Index rows) {
    constexpr Index group = 3;
    const Index channels = whitened.rows() / rows;
    const Index groups = (rows + group - 1) / group;
    Eigen::MatrixXd result(channels * groups, whitened.cols());
    for (Index column = 0; column < whitened.cols(); ++column) {
        for (Index channel = 0; channel < channels; ++channel) {
            for (Index k = 0; k < groups; ++k) {
                const Index count = std::min(group, rows - k * group);
                result(channel * groups + k, column) =
                    whitened.col(column).segment(channel * rows + k * group, count).sum() /
                    std::sqrt(static_cast<double>(count));
            }
        }
    }
    return result;
}

Fit with_pooled_readings(const Fit& fit) {
    const Eigen::Index rows = fit.point.simulated_C.rows(), readings = fit.point.simulated_C.size();
    const Eigen::Index priors = fit.jacobian.cols();
    const Eigen::MatrixXd some = pooled(fit.jacobian.topRows(readings), rows);
    Fit result{fit.model, fit.parameters, {}, {}, {}, fit.iterations, fit.converged};
    result.jacobian.resize(some.rows() + priors, priors);
    result.jacobian << some, fit.jacobian.bottomRows(priors);
    result.hessian = result.jacobian.transpose() * result.jacobian;
    result.point.residual.resize(some.rows() + priors);
    result.point.residual << pooled(fit.point.residual.head(readings), rows), fit.point.residual.tail(priors);
    return result;
}

}  // namespace thermbal
