#include "regression/folds.hpp"

#include <algorithm>
#include <numeric>
#include <random>
#include <utility>

namespace thermbal {
namespace {

/// Fisher and Yates, written out: std::shuffle may differ between standard libraries.
void shuffle(std::vector<std::size_t>& order, std::uint64_t seed) {
    std::mt19937_64 generator(seed);
    for (std::size_t k = order.size(); k > 1; --k) std::swap(order[k - 1], order[generator() % k]);
}

}  // namespace

std::vector<Fold> make_folds(std::size_t rows, std::size_t folds, FoldKind kind, std::uint64_t seed) {
    std::vector<std::size_t> order(rows);
    std::iota(order.begin(), order.end(), std::size_t{0});
    if (kind == FoldKind::shuffled) shuffle(order, seed);
    std::vector<Fold> result(folds);
    auto next = order.begin();
    for (std::size_t f = 0; f < folds; ++f) {
        const auto size = static_cast<std::ptrdiff_t>(rows / folds + (f < rows % folds ? 1 : 0));
        Fold& fold = result[f];
        fold.held_out_rows.assign(next, next + size);
        fold.training_rows.assign(order.begin(), next);
        fold.training_rows.insert(fold.training_rows.end(), next + size, order.end());
        std::ranges::sort(fold.held_out_rows);
        std::ranges::sort(fold.training_rows);
        next += size;
    }
    return result;
}

}  // namespace thermbal
