// Ours, libsvm and scikit-learn on the same windows: time, ratio, agreement. Then the whole sweep of 15
// channels on two threads. Takes about five minutes, nearly all of it the other two's.

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
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

std::string comma_separated(const std::vector<double>& values) {
    return fmt::format("{}", fmt::join(values, ","));
}

void compare(const std::vector<double>& window, std::size_t lags) {
    SweepOptions options;
    const auto problem = *make_lag_problem(window, lags, 0.0);
    Result<GridChoice> chosen;
    const double ours_s = seconds_of([&] { chosen = search_grid(problem, options, never_cancelled); });
    const auto prediction = predict(window, lags, chosen->C, chosen->sigma, 1, options);
    options.solver = SvrSolver::libsvm;
    const double libsvm_s =
        seconds_of([&] { static_cast<void>(search_grid(problem, options, never_cancelled)); });
    const auto answer = thermbal::testing::ask_python(
        "bench/regression/scikit_peer.py",
        fmt::format("{} {} {} {} {}{}\n", lags, chosen->C, chosen->sigma, comma_separated(options.C_grid),
                    comma_separated(options.sigma_grid), thermbal::testing::to_words(window)));
    if (answer.size() != 1 || answer[0].size() != 6) {
        fmt::print("scikit-learn did not answer\n");
        return;
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
    const double wall_s = seconds_of([&] {
        for (const auto& window : windows) static_cast<void>(sweep(window, SweepOptions{}, on_two_threads));
    });
    fmt::print("15 channels x 35 n x 64 points x 5 folds, {} samples, 2 threads: {:.2f} s\n", samples,
               wall_s);
    std::fflush(stdout);
}

}  // namespace

int main() {
    fmt::print(
        "samples n | ours s libsvm s scikit s | x libsvm, x scikit | ours: C sigma cv | scikit: C sigma cv, "
        "cv at "
        "ours | steady state C: ours, scikit at ours\n");
    for (const std::size_t samples : {192, 480, 1600}) {
        const auto window =
            thermbal::testing::filtered_warm_up(thermbal::testing::two_constants, samples, 21);
        for (const std::size_t lags :
             samples > 1000 ? std::vector<std::size_t>{5, 25} : std::vector<std::size_t>{1, 5, 15, 35}) {
            compare(window, lags);
        }
    }
    for (const std::size_t samples : {192, 480, 1600}) whole_sweep(samples);
}
