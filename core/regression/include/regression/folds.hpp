#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace thermbal {

enum class FoldKind {
    contiguous,  ///< blocks of neighbouring rows, scikit-learn's KFold: a left-out block has to be
                 ///< extrapolated
    shuffled,    ///< rows at random: a left-out row has its neighbours of 15 s before and after among the
                 ///< others
};

/// One fold of a cross-validation: both ascending.
struct Fold {
    std::vector<std::size_t> training_rows;
    std::vector<std::size_t> held_out_rows;
};

/// Splits `rows` into `folds` parts; the first rows % folds have one row more, as in scikit-learn's KFold.
/// REQUIRES: 2 <= folds <= rows. `seed` only matters for shuffled.
std::vector<Fold> make_folds(std::size_t rows, std::size_t folds, FoldKind kind, std::uint64_t seed);

}  // namespace thermbal
