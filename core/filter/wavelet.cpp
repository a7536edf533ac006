#include "filter/wavelet.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <fmt/format.h>

namespace thermbal {
namespace {

using NamedBoundary = std::pair<std::string_view, Boundary>;
constexpr std::array<NamedBoundary, 9> boundary_names{{{"zero", Boundary::zero},
                                                       {"constant", Boundary::constant},
                                                       {"symmetric", Boundary::symmetric},
                                                       {"reflect", Boundary::reflect},
                                                       {"periodic", Boundary::periodic},
                                                       {"smooth", Boundary::smooth},
                                                       {"antisymmetric", Boundary::antisymmetric},
                                                       {"antireflect", Boundary::antireflect},
                                                       {"periodization", Boundary::periodization}}};

struct ScalingFilter {
    std::string_view name;
    std::vector<double> coefficients;
};

const std::vector<ScalingFilter>& scaling_filters() {
    static const std::vector<ScalingFilter> filters{
#include "wavelet_tables.inc"
    };
    return filters;
}

using Index = std::ptrdiff_t;

Index modulo(Index value, Index period) {
    return ((value % period) + period) % period;
}

/// The sample at `index`, which may lie outside the signal.
double extended(std::span<const double> x, Index index, Boundary boundary) {
    const auto n = static_cast<Index>(x.size());
    const auto at = [&](Index i) { return x[static_cast<std::size_t>(i)]; };
    if (index >= 0 && index < n) return at(index);
    switch (boundary) {
        case Boundary::zero:
            return 0.0;
        case Boundary::constant:
            return index < 0 ? at(0) : at(n - 1);
        case Boundary::symmetric:
        case Boundary::antisymmetric: {
            const Index folded = modulo(index, 2 * n);
            if (folded < n) return at(folded);
            return boundary == Boundary::symmetric ? at(2 * n - 1 - folded) : -at(2 * n - 1 - folded);
        }
        case Boundary::reflect: {
            if (n == 1) return at(0);
            const Index folded = modulo(index, 2 * n - 2);
            return at(folded < n ? folded : 2 * n - 2 - folded);
        }
        case Boundary::antireflect:
            if (n == 1) return at(0);
            return index < 0 ? 2.0 * at(0) - extended(x, -index, boundary)
                             : 2.0 * at(n - 1) - extended(x, 2 * (n - 1) - index, boundary);
        case Boundary::smooth:
            if (n == 1) return at(0);
            return index < 0 ? at(0) + static_cast<double>(-index) * (at(0) - at(1))
                             : at(n - 1) + static_cast<double>(index - n + 1) * (at(n - 1) - at(n - 2));
        case Boundary::periodic:
        case Boundary::periodization:
            return at(modulo(index, n));
    }
    return 0.0;
}

DwtLevel convolve_and_halve(std::span<const double> padded, std::size_t outputs, const Wavelet& wavelet) {
    const std::size_t length = wavelet.length();
    DwtLevel level{std::vector<double>(outputs), std::vector<double>(outputs)};
    for (std::size_t i = 0; i < outputs; ++i) {
        double low = 0.0;
        double high = 0.0;
        for (std::size_t j = 0; j < length; ++j) {
            const double sample = padded[2 * i + length - 1 - j];
            low += wavelet.decompose_low[j] * sample;
            high += wavelet.decompose_high[j] * sample;
        }
        level.approximation[i] = low;
        level.detail[i] = high;
    }
    return level;
}

/// An orthogonal transform is undone by its transpose.
std::vector<double> idwt_periodization(std::span<const double> approximation, std::span<const double> detail,
                                       const Wavelet& wavelet) {
    const auto samples = static_cast<Index>(2 * approximation.size());
    const auto length = static_cast<Index>(wavelet.length());
    std::vector<double> signal(static_cast<std::size_t>(samples), 0.0);
    for (std::size_t i = 0; i < approximation.size(); ++i) {
        for (Index j = 0; j < length; ++j) {
            const auto k =
                static_cast<std::size_t>(modulo(2 * static_cast<Index>(i) + length / 2 - j, samples));
            const auto tap = static_cast<std::size_t>(j);
            signal[k] +=
                wavelet.decompose_low[tap] * approximation[i] + wavelet.decompose_high[tap] * detail[i];
        }
    }
    return signal;
}

}  // namespace

std::string_view to_string(Boundary boundary) {
    const auto* found = std::ranges::find(boundary_names, boundary, &NamedBoundary::second);
    return found == boundary_names.end() ? "unknown" : found->first;
}

std::optional<Boundary> boundary_from_string(std::string_view name) {
    const auto* found = std::ranges::find(boundary_names, name, &NamedBoundary::first);
    if (found == boundary_names.end()) return std::nullopt;
    return found->second;
}

Result<Wavelet> wavelet_by_name(std::string_view name) {
    const std::string_view wanted = name == "haar" ? "db1" : name;
    const auto& filters = scaling_filters();
    const auto found = std::ranges::find(filters, wanted, &ScalingFilter::name);
    if (found == filters.end()) {
        std::string known;
        for (const auto& filter : filters)
            known += fmt::format("{}{}", known.empty() ? "" : ", ", filter.name);
        return fail(NextStep::refuse_input,
                    fmt::format("no wavelet is named '{}'; known are {}", name, known));
    }
    Wavelet wavelet;
    wavelet.name = name;
    wavelet.reconstruct_low = found->coefficients;
    wavelet.decompose_low.assign(found->coefficients.rbegin(), found->coefficients.rend());
    for (std::size_t k = 0; k < wavelet.length(); ++k) {
        wavelet.reconstruct_high.push_back((k % 2 == 0 ? 1.0 : -1.0) * wavelet.decompose_low[k]);
    }
    wavelet.decompose_high.assign(wavelet.reconstruct_high.rbegin(), wavelet.reconstruct_high.rend());
    return wavelet;
}

std::size_t max_dwt_level(std::size_t samples, std::size_t wavelet_length) {
    std::size_t level = 0;
    while (wavelet_length > 1 && (samples >> (level + 1)) >= wavelet_length - 1) ++level;
    return level;
}

DwtLevel dwt(std::span<const double> signal, const Wavelet& wavelet, Boundary boundary) {
    std::vector<double> even;
    if (boundary == Boundary::periodization && signal.size() % 2 == 1) {
        even.assign(signal.begin(), signal.end());
        even.push_back(signal.back());
        signal = even;
    }
    const std::size_t length = wavelet.length();
    const bool periodized = boundary == Boundary::periodization;
    const std::size_t outputs = periodized ? signal.size() / 2 : (signal.size() + length - 1) / 2;
    // Output i looks at the samples 2i + first ... 2i + first - length + 1.
    const Index first = periodized ? static_cast<Index>(length / 2) : 1;
    std::vector<double> padded(2 * outputs + length);
    for (std::size_t k = 0; k < padded.size(); ++k) {
        padded[k] =
            extended(signal, static_cast<Index>(k) + first - static_cast<Index>(length) + 1, boundary);
    }
    return convolve_and_halve(padded, outputs, wavelet);
}

std::vector<double> idwt(std::span<const double> approximation, std::span<const double> detail,
                         const Wavelet& wavelet, Boundary boundary) {
    if (boundary == Boundary::periodization) return idwt_periodization(approximation, detail, wavelet);
    const std::size_t length = wavelet.length();
    if (2 * approximation.size() + 2 <= length) return {};
    std::vector<double> signal(2 * approximation.size() + 2 - length, 0.0);
    for (std::size_t m = 0; m < signal.size(); ++m) {
        const std::size_t end = m + length - 2;
        for (std::size_t tap = end % 2; tap < length; tap += 2) {
            const std::size_t i = (end - tap) / 2;
            signal[m] +=
                wavelet.reconstruct_low[tap] * approximation[i] + wavelet.reconstruct_high[tap] * detail[i];
        }
    }
    return signal;
}

Result<WaveletDecomposition> wavedec(std::span<const double> signal, const Wavelet& wavelet,
                                     Boundary boundary, std::size_t levels) {
    if (signal.empty()) return fail(NextStep::refuse_input, "the signal to transform is empty");
    const auto bad = std::ranges::find_if(signal, [](double value) { return !std::isfinite(value); });
    if (bad != signal.end()) {
        return fail(NextStep::refuse_input,
                    fmt::format("sample {} of the signal to transform is not a number; fill gaps first",
                                bad - signal.begin()));
    }
    WaveletDecomposition decomposition;
    decomposition.approximation.assign(signal.begin(), signal.end());
    for (std::size_t level = 0; level < levels; ++level) {
        auto split = dwt(decomposition.approximation, wavelet, boundary);
        decomposition.approximation = std::move(split.approximation);
        decomposition.details.push_back(std::move(split.detail));
    }
    return decomposition;
}

std::vector<double> waverec(const WaveletDecomposition& decomposition, const Wavelet& wavelet,
                            Boundary boundary) {
    std::vector<double> signal = decomposition.approximation;
    for (std::size_t level = decomposition.details.size(); level-- > 0;) {
        const auto& detail = decomposition.details[level];
        if (signal.size() == detail.size() + 1) signal.pop_back();
        signal = idwt(signal, detail, wavelet, boundary);
    }
    return signal;
}

}  // namespace thermbal
