#include "fidelity.hpp"

#include <array>
#include <limits>
#include <utility>
#include <vector>

#include "base/median.hpp"

namespace thermbal {
namespace {

constexpr std::array shares_tried = {0.0001, 0.0002, 0.0003, 0.00045, 0.0007, 0.001, 0.0015, 0.002, 0.003,
                                     0.0045, 0.007,  0.01,   0.015,   0.023,  0.035, 0.05,   0.08};

}  // namespace

double share_of_rise_seen(const FitData& data, const FitPoint& point, const ModelFidelity& fidelity) {
    std::vector<double> best(data.seen.columns(), -std::numeric_limits<double>::infinity());
    std::vector<double> share(best.size(), 0.0);
    ModelFidelity tried = fidelity;
    for (const double one : shares_tried) {
        tried.share_of_rise = one;
        const Eigen::VectorXd density = Whitening(data.seen, tried).log_density(point.difference_C);
        for (std::size_t c = 0; c < best.size(); ++c) {
            const double here = density(static_cast<Eigen::Index>(c));
            if (here <= best[c]) continue;
            best[c] = here;
            share[c] = one;
        }
    }
    return upper_median(std::move(share));
}

void allow_for(Evidence& evidence, double share_of_rise) {
    ModelFidelity& fidelity = evidence.calibration.fidelity;
    fidelity.share_of_rise = share_of_rise;
    evidence.run.whitening = Whitening(evidence.run.seen, fidelity);
    for (FitData& holdout : evidence.holdouts) holdout.whitening = Whitening(holdout.seen, fidelity);
}

}  // namespace thermbal
