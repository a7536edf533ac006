#include "modal_system.hpp"

#include <algorithm>
#include <limits>

#include <Eigen/Eigenvalues>

namespace thermbal {
namespace {

using Eigen::Index;

Eigen::MatrixXd conductance_matrix(const CompiledNetwork& network, const Eigen::VectorXd& surface_W_per_K) {
    Eigen::MatrixXd matrix = surface_W_per_K.asDiagonal();
    for (const CompiledLink& link : network.links) {
        const auto a = static_cast<Index>(link.a);
        const auto b = static_cast<Index>(link.b);
        matrix(a, a) += link.conductance_W_per_K;
        matrix(b, b) += link.conductance_W_per_K;
        matrix(a, b) -= link.conductance_W_per_K;
        matrix(b, a) -= link.conductance_W_per_K;
    }
    return matrix;
}

Eigen::VectorXd surfaces_at(const CompiledNetwork& network, double time_s) {
    Eigen::VectorXd surface = Eigen::Map<const Eigen::VectorXd>(
        network.surface_W_per_K.data(), static_cast<Index>(network.surface_W_per_K.size()));
    for (const SurfaceChange& change : network.surface_changes) {
        if (change.from_s <= time_s) surface[static_cast<Index>(change.node)] *= change.factor;
    }
    return surface;
}

}  // namespace

Eigen::VectorXd ModalSystem::modal_from_temperatures(const Eigen::VectorXd& node_C) const {
    return from_temperatures_ * node_C;
}

ModalSystem decompose(const CompiledNetwork& network, const Eigen::VectorXd& surface_W_per_K) {
    const Eigen::VectorXd root =
        Eigen::Map<const Eigen::VectorXd>(network.capacity_J_per_K.data(),
                                          static_cast<Index>(network.capacity_J_per_K.size()))
            .cwiseSqrt();
    const Eigen::VectorXd inverse_root = root.cwiseInverse();
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(
        inverse_root.asDiagonal() * conductance_matrix(network, surface_W_per_K) * inverse_root.asDiagonal());
    ModalSystem system;
    system.rate_per_s = solver.eigenvalues().cwiseMax(0.0);
    system.to_nodal = inverse_root.asDiagonal() * solver.eigenvectors();
    system.to_modal = solver.eigenvectors().transpose() * inverse_root.asDiagonal();
    system.from_temperatures_ = solver.eigenvectors().transpose() * root.asDiagonal();
    system.surface_W_per_K = surface_W_per_K;
    return system;
}

std::vector<NetworkRegime> regimes_of(const CompiledNetwork& network) {
    std::vector<double> from_s = {-std::numeric_limits<double>::infinity()};
    for (const SurfaceChange& change : network.surface_changes) from_s.push_back(change.from_s);
    std::ranges::sort(from_s);
    from_s.erase(std::ranges::unique(from_s).begin(), from_s.end());
    std::vector<NetworkRegime> regimes;
    regimes.reserve(from_s.size());
    for (const double from : from_s)
        regimes.push_back({from, decompose(network, surfaces_at(network, from))});
    return regimes;
}

}  // namespace thermbal
