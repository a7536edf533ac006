#include "carry_over.hpp"

#include <cmath>

#include <fmt/format.h>

namespace thermbal {
namespace {

/// Below this a held-out run is as good as before.
constexpr double much_worse = 1.05;

}  // namespace

void doubt_what_does_not_carry_over(Diagnosis& diagnosis) {
    double before = 0.0;
    double after = 0.0;
    for (const RunComparison& held : diagnosis.holdouts) {
        before += held.before_rmse_C * held.before_rmse_C;
        after += held.after_rmse_C * held.after_rmse_C;
    }
    if (diagnosis.effects.empty() || !(after > much_worse * much_worse * before)) return;
    for (FoundEffect& found : diagnosis.effects) found.probability *= before / after;
    if (diagnosis.verdict == GapVerdict::explained) diagnosis.verdict = GapVerdict::partly_explained;
    const auto runs = static_cast<double>(diagnosis.holdouts.size());
    diagnosis.reason += fmt::format(
        "; but the held-out gap grows with them from {:.3f} to {:.3f} C, so the names are doubtful: see the "
        "alternatives",
        std::sqrt(before / runs), std::sqrt(after / runs));
}

}  // namespace thermbal
