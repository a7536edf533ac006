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

}  // namespace thermbal
