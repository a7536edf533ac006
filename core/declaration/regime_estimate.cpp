#include "regime_estimate.hpp"

namespace thermbal {

Result<ArchivedEstimate> estimate_regime(const TestWindow& regime, const std::vector<double>& start_level_C,
                                         const FlowOptions& options) {
    if (options.prior) {
        return estimate_with_archive(regime, options.ambient, *options.prior, options.spectrum, options.seed,
                                     start_level_C);
    }
    auto plain = estimate_spectrum(regime, options.ambient, std::nullopt, options.spectrum, options.seed,
                                   start_level_C);
    if (!plain) return std::unexpected(plain.error());
    return ArchivedEstimate{std::move(*plain), {}};
}

}  // namespace thermbal
