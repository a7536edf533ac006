#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

namespace thermbal {

/// Of these rows of a problem those that a kernel of every stride-th row has, as rows of the kernel.
std::vector<Eigen::Index> kernel_rows(const std::vector<std::size_t>& rows, std::size_t stride);

/// To this smoothing; where that takes long from here, through the wider ones. Not seen to fall short then;
/// the state is the best there is in any case.
template <typename Solver>
void descend_surely(Solver& solver, double smoothing) {
    constexpr int quick_steps = 100, patient_steps = 1000;
    if (solver.descend_to(smoothing, quick_steps)) return;
    for (double wide = 0.5; wide > smoothing; wide *= 0.3) {
        static_cast<void>(solver.descend_to(wide, patient_steps));
    }
    static_cast<void>(solver.descend_to(smoothing, patient_steps));
}

}  // namespace thermbal
