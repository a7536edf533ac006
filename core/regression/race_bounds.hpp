#pragma once

#include <cstddef>

namespace thermbal {

/// Below what a held-out error will not fall when the smoothing goes on to 0, from what the last step of
/// smoothing has done.
double lowest_rmse(double rmse, double before, double smoothing);

/// The same where no step of smoothing has been seen yet.
double lowest_rmse_at_first(double rmse, double smoothing);

/// First folds' errors that lose where the best mean squared error over `folds` folds is `best_mean_mse`:
/// alone, and where the next C's is larger still.
double hopeless_rmse(double best_mean_mse, std::size_t folds);
double worse_rmse(double best_mean_mse, std::size_t folds);

/// Of the error to beat, what the truncation of a kernel may move a prediction by at the very most. Where the
/// rows are many their parts of it cancel, and the better, the more of the window is noise (README.md).
double truncation_share(std::size_t rows, double noise_in_epsilons);

/// To where a kernel may be truncated when an error of `share` of `rmse` in the predictions does not matter:
/// no prediction moves by more than the tolerance times the sum of |c|. In steps, so that an error a little
/// smaller is no reason to begin anew; never below `finest`.
double truncation(double share, double rmse, double coefficient_sum, double finest);

/// Of how many features one more than these costs more than a whole kernel of so many rows: about as many as
/// rows bend at this smoothing in a window of noise.
std::size_t features_worth_having(std::size_t rows, double smoothing, double noise_rmse);

}  // namespace thermbal
