#pragma once

#include <cstddef>
#include <vector>

namespace thermbal {

/// One step of the classical fourth-order Runge-Kutta method for y' = f(t, y).
template <typename Derivative>
void runge_kutta_step(const Derivative& f, double t, double step, std::vector<double>& y) {
    const auto moved = [&y](const std::vector<double>& slope, double by) {
        std::vector<double> at = y;
        for (std::size_t i = 0; i < at.size(); ++i) at[i] += by * slope[i];
        return at;
    };
    const std::vector<double> k1 = f(t, y);
    const std::vector<double> k2 = f(t + step / 2.0, moved(k1, step / 2.0));
    const std::vector<double> k3 = f(t + step / 2.0, moved(k2, step / 2.0));
    const std::vector<double> k4 = f(t + step, moved(k3, step));
    for (std::size_t i = 0; i < y.size(); ++i) {
        y[i] += step / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
    }
}

}  // namespace thermbal
