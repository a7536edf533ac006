#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/error.hpp"

namespace thermbal {

/// How a finite signal goes on beyond its two ends while it is transformed. Names and meaning are those of
/// PyWavelets.
enum class Boundary {
    zero,
    constant,
    symmetric,
    reflect,
    periodic,
    smooth,  ///< straight line through the two outermost samples
    antisymmetric,
    antireflect,
    periodization,  ///< periodic, with as few coefficients as samples
};

std::string_view to_string(Boundary boundary);
std::optional<Boundary> boundary_from_string(std::string_view name);

/// An orthogonal wavelet by its scaling filter, sum sqrt(2), of even length (2 for db1 = Haar, 8 for db4).
/// `decompose_*` are the time-reversed `reconstruct_*`; high-pass by the alternating flip, as in PyWavelets.
struct Wavelet {
    std::string name;
    std::vector<double> decompose_low, decompose_high, reconstruct_low, reconstruct_high;

    std::size_t length() const { return reconstruct_low.size(); }
};

/// db1 ... db8, haar, sym4, sym5, sym6, sym8, coif1. Error (refuse_input) names what is known.
Result<Wavelet> wavelet_by_name(std::string_view name);

/// The coefficients of one level.
struct DwtLevel {
    std::vector<double> approximation, detail;
};

/// floor(log2(samples / (length - 1))), at least 0: deeper levels are all boundary.
std::size_t max_dwt_level(std::size_t samples, std::size_t wavelet_length);

/// One level of the discrete wavelet transform (Mallat). `signal` must not be empty. Each part has
/// floor((samples + length - 1) / 2) coefficients, with periodization ceil(samples / 2).
DwtLevel dwt(std::span<const double> signal, const Wavelet& wavelet, Boundary boundary);

/// The inverse; both parts of the same length. Gives one sample more than went in when that number was odd.
std::vector<double> idwt(std::span<const double> approximation, std::span<const double> detail,
                         const Wavelet& wavelet, Boundary boundary);

/// A multi-level transform: `details[0]` is the finest level.
struct WaveletDecomposition {
    std::vector<double> approximation;
    std::vector<std::vector<double>> details;
};

/// `levels` times dwt. Errors (refuse_input): empty signal, NaN or infinity in it.
Result<WaveletDecomposition> wavedec(std::span<const double> signal, const Wavelet& wavelet,
                                     Boundary boundary, std::size_t levels);

/// The inverse of wavedec; one sample longer than the signal was when that number was odd.
std::vector<double> waverec(const WaveletDecomposition& decomposition, const Wavelet& wavelet,
                            Boundary boundary);

}  // namespace thermbal
