#include "phi.hpp"

#include <cmath>
#include <cstddef>

namespace thermbal {

template <std::size_t Count>
std::array<double, Count> phi_functions(double z) {
    std::array<double, Count> phi{};
    phi[0] = std::exp(z);
    // The recursion upwards divides rounding errors by z; near 0 the series of the last one and the recursion
    // downwards, phi_k = z phi_k+1 + 1/k!, lose nothing.
    std::array<double, Count> inverse_factorial{1.0};
    for (std::size_t k = 1; k < Count; ++k)
        inverse_factorial[k] = inverse_factorial[k - 1] / static_cast<double>(k);
    if (std::abs(z) > 1.0) {
        for (std::size_t k = 1; k < Count; ++k) phi[k] = (phi[k - 1] - inverse_factorial[k - 1]) / z;
        return phi;
    }
    constexpr int terms = 18;
    constexpr double lost_in_rounding = 1e-18;
    double term = inverse_factorial[Count - 1];
    for (int j = 0; j < terms && std::abs(term) > lost_in_rounding; ++j) {
        phi[Count - 1] += term;
        term *= z / static_cast<double>(static_cast<int>(Count) + j);
    }
    for (std::size_t k = Count - 2; k > 0; --k) phi[k] = z * phi[k + 1] + inverse_factorial[k];
    return phi;
}

template std::array<double, 4> phi_functions<4>(double z);
template std::array<double, 5> phi_functions<5>(double z);

}  // namespace thermbal
