#pragma once

#include <span>

#include <Eigen/Core>

#include "network_builder.hpp"

namespace thermbal {

/// The linear part of a network, C dT/dt = -K T + q, in coordinates in which it is diagonal: T = to_nodal z,
/// dz/dt = -rate z + to_modal q. K is symmetric (what leaves a node enters its neighbour) and C diagonal and
/// positive, so the coordinates are orthogonal and the rates real and not negative: no exponential can fail.
struct ModalSystem {
    Eigen::VectorXd rate_per_s;
    Eigen::MatrixXd to_nodal;
    Eigen::MatrixXd to_modal;         ///< takes heat flows, W
    Eigen::VectorXd surface_W_per_K;  ///< conductance to the ambient that is inside K, per node

    Eigen::VectorXd modal_from_temperatures(const Eigen::VectorXd& node_C) const;

  private:
    friend ModalSystem decompose(const CompiledNetwork& network, const Eigen::VectorXd& surface_W_per_K);
    Eigen::MatrixXd from_temperatures_;
};

ModalSystem decompose(const CompiledNetwork& network, const Eigen::VectorXd& surface_W_per_K);

/// The linear part between two changes of a surface, from from_s on.
struct NetworkRegime {
    double from_s;
    ModalSystem system;
};

/// In the order of time; the first holds from the beginning.
std::vector<NetworkRegime> regimes_of(const CompiledNetwork& network);

}  // namespace thermbal
