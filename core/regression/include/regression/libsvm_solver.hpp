#pragma once

#include <memory>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "base/error.hpp"
#include "regression/svr.hpp"

namespace thermbal {

/// epsilon-SVR by libsvm on one kernel matrix, for any C and any subset of its rows: the reference path.
/// 16 bytes a kernel element. One object a thread.
class LibsvmSolver {
  public:
    explicit LibsvmSolver(const Eigen::MatrixXd& kernel);
    ~LibsvmSolver();
    LibsvmSolver(LibsvmSolver&&) noexcept;
    LibsvmSolver& operator=(LibsvmSolver&&) noexcept;

    /// Fits on `rows` (indices into the kernel matrix); `targets` has one value a row of the kernel matrix.
    /// The coefficients are in the order of `rows`. Error (stop): libsvm gave no model.
    Result<SvrFit> fit(std::span<const std::size_t> rows, std::span<const double> targets,
                       const SvrParameters& parameters) const;

  private:
    struct Nodes;
    std::unique_ptr<Nodes> nodes_;
};

}  // namespace thermbal
