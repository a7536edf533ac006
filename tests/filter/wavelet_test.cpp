#include "filter/wavelet.hpp"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "python_peer.hpp"

namespace thermbal {
namespace {

using testing::Numbers;

struct Case {
    std::string wavelet;
    Boundary boundary;
    std::size_t levels;
    Numbers signal;
};

Numbers noisy_warm_up(std::size_t samples, std::mt19937_64& random) {
    std::normal_distribution<double> noise(0.0, 0.05);
    Numbers signal(samples);
    for (std::size_t k = 0; k < samples; ++k) {
        signal[k] = 26.7 - 8.7 * std::exp(-static_cast<double>(k) / 170.0) + noise(random);
    }
    return signal;
}

std::vector<Case> cases() {
    constexpr Boundary boundaries[] = {
        Boundary::zero,          Boundary::constant,    Boundary::symmetric,
        Boundary::reflect,       Boundary::periodic,    Boundary::smooth,
        Boundary::antisymmetric, Boundary::antireflect, Boundary::periodization};
    std::mt19937_64 random(7);
    std::vector<Case> all;
    for (const char* wavelet :
         {"db1", "db2", "db3", "db4", "db5", "db6", "db7", "db8", "sym4", "sym5", "sym6", "sym8", "coif1"}) {
        const std::size_t length = wavelet_by_name(wavelet)->length();
        for (const Boundary boundary : boundaries) {
            for (const std::size_t samples : {31U, 32U, 33U, 100U, 191U, 192U, 193U, 480U}) {
                const std::size_t deepest = std::min<std::size_t>(max_dwt_level(samples, length), 6);
                for (std::size_t levels = 1; levels <= deepest; ++levels) {
                    all.push_back({wavelet, boundary, levels, noisy_warm_up(samples, random)});
                }
            }
        }
    }
    return all;
}

Numbers flat_coefficients(const WaveletDecomposition& decomposition) {
    Numbers flat = decomposition.approximation;
    for (std::size_t level = decomposition.details.size(); level-- > 0;) {
        const auto& detail = decomposition.details[level];
        flat.insert(flat.end(), detail.begin(), detail.end());
    }
    return flat;
}

double largest_difference(const Numbers& a, const Numbers& b) {
    if (a.size() != b.size()) return INFINITY;
    double largest = 0.0;
    for (std::size_t k = 0; k < a.size(); ++k) largest = std::max(largest, std::abs(a[k] - b[k]));
    return largest;
}

TEST(Wavelet, CoefficientsAndReconstructionAreThoseOfPyWavelets) {
    const auto all = cases();
    std::string requests;
    for (const Case& one : all) {
        requests += one.wavelet + " " + std::string(to_string(one.boundary)) + " " +
                    std::to_string(one.levels) + testing::to_words(one.signal) + "\n";
    }
    const auto answers = testing::ask_python("filter/wavelet_peer.py", requests);
    ASSERT_EQ(answers.size(), 2 * all.size());
    for (std::size_t k = 0; k < all.size(); ++k) {
        const Case& one = all[k];
        SCOPED_TRACE(one.wavelet + " " + std::string(to_string(one.boundary)) + " levels " +
                     std::to_string(one.levels) + " samples " + std::to_string(one.signal.size()));
        const Wavelet wavelet = *wavelet_by_name(one.wavelet);
        const auto decomposition = wavedec(one.signal, wavelet, one.boundary, one.levels);
        ASSERT_TRUE(decomposition);
        EXPECT_LT(largest_difference(flat_coefficients(*decomposition), answers[2 * k]), 1e-10);
        EXPECT_LT(largest_difference(waverec(*decomposition, wavelet, one.boundary), answers[2 * k + 1]),
                  1e-10);
    }
}

TEST(Wavelet, ReconstructsWhatWasDecomposed) {
    std::mt19937_64 random(3);
    for (const std::size_t samples : {9U, 50U, 333U, 1600U}) {
        const Numbers signal = noisy_warm_up(samples, random);
        for (const Boundary boundary : {Boundary::smooth, Boundary::periodization, Boundary::antireflect}) {
            const Wavelet wavelet = *wavelet_by_name("db4");
            Numbers rebuilt = waverec(*wavedec(signal, wavelet, boundary, 3), wavelet, boundary);
            rebuilt.resize(samples);
            EXPECT_LT(largest_difference(rebuilt, signal), 1e-9) << samples << to_string(boundary);
        }
    }
}

TEST(Wavelet, RefusesWhatItCannotTransform) {
    EXPECT_EQ(wavelet_by_name("db99").error().next, NextStep::refuse_input);
    EXPECT_NE(wavelet_by_name("db99").error().message.find("db4"), std::string::npos);
    const Wavelet wavelet = *wavelet_by_name("db4");
    EXPECT_FALSE(wavedec(Numbers{}, wavelet, Boundary::smooth, 1));
    EXPECT_FALSE(wavedec(Numbers{1.0, NAN, 2.0}, wavelet, Boundary::smooth, 1));
    EXPECT_EQ(boundary_from_string("smooth"), Boundary::smooth);
    EXPECT_EQ(boundary_from_string("Smooth"), std::nullopt);
}

}  // namespace
}  // namespace thermbal
