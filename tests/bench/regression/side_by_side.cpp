// Ours, libsvm and scikit-learn on the same windows: CPU time, ratio, agreement. scikit-learn's and libsvm's
// whole sweep of 35 n is extrapolated from the n that are timed, each with its whole grid of 320 fits; with
// --all-192 every n is timed at 192 samples. Then the whole sweep of 15 channels on two threads. About two
// CPU minutes, nearly all of it the other two's; a quarter of a minute more a channel with --all-192.

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <ctime>
#include <numeric>
#include <string_view>
#include <thread>

#include <fmt/format.h>

#include "../../filter/python_peer.hpp"
#include "../../regression/windows.hpp"
#include "regression/grid_search.hpp"

namespace {

using namespace thermbal;

double seconds_of(const auto& work) {
    const auto started = std::chrono::steady_clock::now();
    work();
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
}

/// Of all threads of this process; what else runs on the machine does not count.
double cpu_seconds_of(const auto& work) {
    const std::clock_t started = std::clock();
    work();
    return static_cast<double>(std::clock() - started) / CLOCKS_PER_SEC;
}

struct OthersTime {
    double libsvm_s = 0.0;
    double scikit_s = 0.0;
};

std::string comma_separated(const std::vector<double>& values) {
    return fmt::format("{}", fmt::join(values, ","));
}

OthersTime compare(const std::vector<double>& window, std::size_t lags) {
    SweepOptions options;
    const auto problem = *make_lag_problem(window, lags, 0.0);
    Result<GridChoice> chosen;
    const double ours_s = cpu_seconds_of([&] { chosen = search_grid(problem, options, never_cancelled); });
    const auto prediction = predict(window, lags, chosen->C, chosen->sigma, 1, options);
    options.solver = SvrSolver::libsvm;
    const double libsvm_s =
        cpu_seconds_of([&] { static_cast<void>(search_grid(problem, options, never_cancelled)); });
    const auto answer = thermbal::testing::ask_python(
        "bench/regression/scikit_peer.py",
        fmt::format("{} {} {} {} {}{}\n", lags, chosen->C, chosen->sigma, comma_separated(options.C_grid),
                    comma_separated(options.sigma_grid), thermbal::testing::to_words(window)));
    if (answer.size() != 1 || answer[0].size() != 6) {
        fmt::print("scikit-learn did not answer\n");
        return {};
    }
    const auto& theirs = answer[0];
    fmt::print(
        "{:5} {:3} | {:8.4f} {:8.2f} {:8.2f} | {:6.0f} {:6.0f} | {:6g} {:4g} {:9.3e} | {:6g} {:4g} {:9.3e} "
        "{:9.3e} | "
        "{:8.3f} {:8.3f}\n",
        window.size(), lags, ours_s, libsvm_s, theirs[0], libsvm_s / ours_s, theirs[0] / ours_s, chosen->C,
        chosen->sigma, std::sqrt(chosen->cv_mse_unit), theirs[1], theirs[2], theirs[3], theirs[4],
        prediction->fit.steady_state_C, theirs[5]);
    std::fflush(stdout);
    return {libsvm_s, theirs[0]};
}

void compare_sweep(std::size_t samples, const std::vector<std::size_t>& timed_lags) {
    const auto window = thermbal::testing::filtered_warm_up(thermbal::testing::two_constants, samples, 21);
    const double ours_s =
        cpu_seconds_of([&] { static_cast<void>(sweep(window, SweepOptions{}, sequential_for)); });
    OthersTime sum;
    for (const std::size_t lags : timed_lags) {
        const OthersTime at = compare(window, lags);
        sum.libsvm_s += at.libsvm_s;
        sum.scikit_s += at.scikit_s;
    }
    const double share =
        static_cast<double>(SweepOptions{}.last_lag) / static_cast<double>(timed_lags.size());
    fmt::print(
        "{} samples, one channel, all 35 n, CPU s: ours {:.3f}, libsvm {:.1f}, scikit-learn {:.1f} ({} of 35 "
        "n "
        "timed): x {:.0f}, x {:.0f}\n",
        samples, ours_s, sum.libsvm_s * share, sum.scikit_s * share, timed_lags.size(),
        sum.libsvm_s * share / ours_s, sum.scikit_s * share / ours_s);
    std::fflush(stdout);
}

void on_two_threads(std::size_t count, const std::function<void(std::size_t)>& body) {
    std::atomic<std::size_t> next{0};
    const auto take = [&] {
        for (std::size_t i = next++; i < count; i = next++) body(i);
    };
    std::thread other(take);
    take();
    other.join();
}

void whole_sweep(std::size_t samples) {
    const std::vector<thermbal::testing::Exponential>* plants[] = {&thermbal::testing::one_constant,
                                                                   &thermbal::testing::two_constants,
                                                                   &thermbal::testing::three_constants};
    std::vector<std::vector<double>> windows;
    for (std::uint64_t channel = 0; channel < 15; ++channel) {
        windows.push_back(thermbal::testing::filtered_warm_up(*plants[channel % 3], samples, channel + 1));
    }
    double cpu_s = 0.0;
    const double wall_s = seconds_of([&] {
        cpu_s = cpu_seconds_of([&] {
            for (const auto& window : windows)
                static_cast<void>(sweep(window, SweepOptions{}, on_two_threads));
        });
    });
    fmt::print("15 channels x 35 n x 64 points x 5 folds, {} samples, 2 threads: {:.2f} s, {:.2f} CPU s\n",
               samples, wall_s, cpu_s);
    std::fflush(stdout);
}

std::vector<std::size_t> every_lag() {
    std::vector<std::size_t> lags(SweepOptions{}.last_lag);
    std::iota(lags.begin(), lags.end(), 1);
    return lags;
}

}  // namespace

int main(int count, char** arguments) {
    const bool all_192 = count > 1 && std::string_view(arguments[1]) == "--all-192";
    fmt::print(
        "CPU seconds, the whole grid of one n\n"
        "samples n | ours s libsvm s scikit s | x libsvm, x scikit | ours: C sigma cv | scikit: C sigma cv, "
        "cv at ours | steady state C: ours, scikit at ours\n");
    compare_sweep(192, all_192 ? every_lag() : std::vector<std::size_t>{1, 5, 15, 25, 35});
    compare_sweep(480, {1, 5, 15, 25, 35});
    compare_sweep(1600, {5, 20, 35});
    for (const std::size_t samples : {192U, 480U, 1600U}) whole_sweep(samples);
}
