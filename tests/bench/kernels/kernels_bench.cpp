// The steps of an identification one by one. The argument is the window in samples of 15 s.

#include <benchmark/benchmark.h>

#include "../../regression/windows.hpp"
#include "filter/outliers.hpp"
#include "modes/spectrum.hpp"
#include "regression/grid_search.hpp"
#include "regression/kernel.hpp"
#include "regression/kernel_features.hpp"
#include "regression/sweep.hpp"

namespace {

using namespace thermbal;

constexpr std::size_t lags = 15;
constexpr double C = 256.0;
constexpr double sigma = 8.0;

std::size_t samples(const benchmark::State& state) {
    return static_cast<std::size_t>(state.range(0));
}

std::vector<double> window(const benchmark::State& state) {
    return thermbal::testing::filtered_warm_up(thermbal::testing::two_constants, samples(state), 21);
}

LagProblem problem(const benchmark::State& state) {
    return *make_lag_problem(window(state), lags, 0.0);
}

void outliers(benchmark::State& state) {
    const auto raw = thermbal::testing::warm_up(thermbal::testing::two_constants, samples(state));
    for (auto _ : state) benchmark::DoNotOptimize(mark_outliers(raw, {}));
}

void wavelet_filter(benchmark::State& state) {
    const auto raw = thermbal::testing::warm_up(thermbal::testing::two_constants, samples(state));
    for (auto _ : state) benchmark::DoNotOptimize(denoise(raw, {}));
}

void whole_kernel_matrix(benchmark::State& state) {
    const auto rows = problem(state);
    for (auto _ : state) benchmark::DoNotOptimize(gaussian_kernel(squared_distances(rows), sigma));
}

void low_rank_factorisation(benchmark::State& state) {
    const auto rows = problem(state);
    for (auto _ : state) benchmark::DoNotOptimize(kernel_features(rows, sigma, feature_tolerance(sigma)));
}

void one_fit(benchmark::State& state) {
    const auto rows = problem(state);
    for (auto _ : state) benchmark::DoNotOptimize(fit_model(rows, C, sigma, SweepOptions{}));
}

void free_run_over_the_window(benchmark::State& state) {
    const auto rows = problem(state);
    const auto model = fit_model(rows, C, sigma, SweepOptions{});
    for (auto _ : state) {
        benchmark::DoNotOptimize(run_freely(*model, rows.scale, rows.input(0), rows.rows(), {}));
    }
}

void grid_of_one_n(benchmark::State& state) {
    const auto rows = problem(state);
    for (auto _ : state) benchmark::DoNotOptimize(search_grid(rows, SweepOptions{}, never_cancelled));
}

void sweep_of_one_channel(benchmark::State& state) {
    const auto filtered = window(state);
    for (auto _ : state) benchmark::DoNotOptimize(sweep(filtered, SweepOptions{}, sequential_for));
}

void spectrum_of_15_channels(benchmark::State& state) {
    TestWindow test;
    test.scans = samples(state);
    for (std::size_t channel = 0; channel < 15; ++channel) {
        auto values = thermbal::testing::warm_up(thermbal::testing::two_constants, samples(state));
        std::mt19937_64 random(channel + 1);
        std::normal_distribution<double> noise(0.0, 0.05);
        for (double& value : values) value += noise(random);
        test.channels.push_back({.name = "T" + std::to_string(channel + 2), .values = std::move(values)});
    }
    for (auto _ : state)
        benchmark::DoNotOptimize(estimate_spectrum(test, "", std::nullopt, SpectrumOptions{}, 1));
}

BENCHMARK(outliers)->Arg(192)->Arg(480)->Arg(1600);
BENCHMARK(wavelet_filter)->Arg(192)->Arg(480)->Arg(1600);
BENCHMARK(whole_kernel_matrix)->Arg(192)->Arg(480)->Arg(1600)->Unit(benchmark::kMicrosecond);
BENCHMARK(low_rank_factorisation)->Arg(192)->Arg(480)->Arg(1600)->Unit(benchmark::kMicrosecond);
BENCHMARK(one_fit)->Arg(192)->Arg(480)->Arg(1600)->Unit(benchmark::kMicrosecond);
BENCHMARK(free_run_over_the_window)->Arg(192)->Arg(480)->Arg(1600)->Unit(benchmark::kMicrosecond);
BENCHMARK(grid_of_one_n)->Arg(192)->Arg(480)->Arg(1600)->Unit(benchmark::kMillisecond);
BENCHMARK(sweep_of_one_channel)->Arg(192)->Arg(480)->Arg(1600)->Unit(benchmark::kMillisecond);
BENCHMARK(spectrum_of_15_channels)->Arg(192)->Arg(480)->Arg(1600)->Unit(benchmark::kMillisecond);

}  // namespace
