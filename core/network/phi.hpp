#pragma once

#include <array>

namespace thermbal {

/// phi_0(z) = exp(z), phi_k+1(z) = (phi_k(z) - 1/k!) / z: a linear system's exact answer to a polynomial
/// forcing is a sum of these (Hochbruck, Ostermann: Exponential integrators, Acta Numerica 2010). For z <= 0,
/// to full precision.
template <std::size_t Count>
std::array<double, Count> phi_functions(double z);

extern template std::array<double, 4> phi_functions<4>(double z);
extern template std::array<double, 5> phi_functions<5>(double z);

}  // namespace thermbal
