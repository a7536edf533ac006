#include "fold_descent.hpp"

namespace thermbal {

std::vector<Eigen::Index> kernel_rows(const std::vector<std::size_t>& rows, std::size_t stride) {
    std::vector<Eigen::Index> kept;
    for (const std::size_t row : rows) {
        if (row % stride == 0) kept.push_back(static_cast<Eigen::Index>(row / stride));
    }
    return kept;
}

}  // namespace thermbal
