#include "mode_sampler.hpp"

#include <algorithm>
#include <cmath>

#include "mode_likelihood.hpp"
#include "random.hpp"

namespace thermbal {

namespace {

class Chain {
  public:
    Chain(const std::vector<WhitenedChannel>& channels, const ModePrior& prior, std::uint64_t seed)
        : likelihood_(channels, prior),
          prior_(prior),
          random_(seed),
          last_(static_cast<double>(prior.intensity.size() - 1)) {
        expected_ = 0.0;
        for (Eigen::Index g = 0; g + 1 < prior.intensity.size(); ++g) {
            expected_ += 0.5 * (prior.intensity[g] + prior.intensity[g + 1]);
            cumulative_.push_back(expected_);
        }
        most_ = std::min(prior.most_modes, ModeLikelihood::most_modes);
        for (std::size_t k = 0; k < 5; ++k) {
            const double share = (static_cast<double>(k) + 0.5) / 5.0;
            modes_.push_back({share * 0.8 * last_, -1.0});
        }
        log_likelihood_ = likelihood_.log_at(modes_);
    }

    void sweep(double temperature) {
        temperature_ = temperature;
        const double which = random_.uniform();
        if (which < 0.15) {
            birth();
        } else if (which < 0.30) {
            death();
        } else if (!modes_.empty()) {
            which < 0.75 ? move() : which < 0.92 ? resize() : move_pair();
        }
    }

    const std::vector<Mode>& modes() const { return modes_; }

  private:
    double draw_position() {
        const double target = random_.uniform() * cumulative_.back();
        const auto cell = static_cast<std::size_t>(
            std::lower_bound(cumulative_.begin(), cumulative_.end(), target) - cumulative_.begin());
        const double before = cell == 0 ? 0.0 : cumulative_[cell - 1];
        const double width = cumulative_[cell] - before;
        const double share = width > 0.0 ? (target - before) / width : 0.5;
        return std::min(static_cast<double>(cell) + share, last_);
    }

    /// Density of draw_position is piecewise constant: that of the cell.
    double log_intensity(double position) const {
        const GridCell cell = cell_of(position, prior_.intensity.size());
        return std::log(0.5 * (prior_.intensity[cell.below] + prior_.intensity[cell.below + 1]));
    }

    double log_variance_prior(const Mode& mode) const {
        const double sd = interpolate(prior_.log_variance_sd, mode.position);
        const double z = (mode.log_variance - interpolate(prior_.log_variance_mean, mode.position)) / sd;
        return -0.5 * z * z - std::log(sd);
    }

    Mode draw_mode() {
        Mode mode;
        mode.position = draw_position();
        mode.log_variance = interpolate(prior_.log_variance_mean, mode.position) +
                            interpolate(prior_.log_variance_sd, mode.position) * random_.normal();
        return mode;
    }

    bool accept(std::vector<Mode>& proposed, double log_prior_ratio) {
        const double likelihood = likelihood_.log_at(proposed);
        const double log_ratio = (likelihood - log_likelihood_) / temperature_ + log_prior_ratio;
        if (!(std::log(random_.uniform()) < log_ratio)) return false;
        modes_.swap(proposed);
        log_likelihood_ = likelihood;
        return true;
    }

    // Born from the prior, a mode's prior and proposal cancel; what is left is expected / (count + 1).
    void birth() {
        if (modes_.size() >= most_) return;
        trial_ = modes_;
        trial_.push_back(draw_mode());
        accept(trial_, std::log(expected_ / static_cast<double>(trial_.size())));
    }

    void death() {
        if (modes_.empty()) return;
        trial_ = modes_;
        const std::size_t victim = pick();
        trial_[victim] = trial_.back();
        trial_.pop_back();
        accept(trial_, std::log(static_cast<double>(modes_.size()) / expected_));
    }

    void move() {
        const std::size_t k = pick();
        trial_ = modes_;
        const double scale = random_.uniform();
        const double reach = scale < 0.3 ? 0.15 : scale < 0.6 ? 0.6 : scale < 0.9 ? 2.5 : 10.0;
        trial_[k].position += reach * random_.normal();
        trial_[k].log_variance += 0.3 * random_.normal();
        if (trial_[k].position < 0.0 || trial_[k].position > last_) return;
        accept(trial_, prior_ratio(k));
    }

    void resize() {
        const std::size_t k = pick();
        trial_ = modes_;
        trial_[k].log_variance += 1.2 * random_.normal();
        accept(trial_, prior_ratio(k));
    }

    // Neighbouring modes trade places along a ridge: one slower, the other faster.
    void move_pair() {
        if (modes_.size() < 2) return;
        const std::size_t k = pick();
        std::size_t other = pick();
        if (other == k) other = (k + 1) % modes_.size();
        trial_ = modes_;
        const double reach = random_.uniform() < 0.5 ? 0.4 : 2.0;
        for (const std::size_t each : {k, other}) {
            trial_[each].position += reach * random_.normal();
            trial_[each].log_variance += 0.3 * random_.normal();
            if (trial_[each].position < 0.0 || trial_[each].position > last_) return;
        }
        accept(trial_, prior_ratio(k) + prior_ratio(other));
    }

    double prior_ratio(std::size_t k) const {
        return log_intensity(trial_[k].position) - log_intensity(modes_[k].position) +
               log_variance_prior(trial_[k]) - log_variance_prior(modes_[k]);
    }

    std::size_t pick() {
        return std::min(modes_.size() - 1,
                        static_cast<std::size_t>(random_.uniform() * static_cast<double>(modes_.size())));
    }

    ModeLikelihood likelihood_;
    const ModePrior& prior_;
    Random random_;
    double last_;
    double expected_ = 0.0;
    std::vector<double> cumulative_;
    std::size_t most_ = 0;
    std::vector<Mode> modes_;
    std::vector<Mode> trial_;
    double log_likelihood_ = 0.0;
    double temperature_ = 1.0;
};

}  // namespace

std::vector<std::vector<Mode>> sample_modes(const std::vector<WhitenedChannel>& channels,
                                            const ModePrior& prior, std::size_t burn_in, std::size_t kept,
                                            std::size_t thinning, std::uint64_t seed) {
    Chain chain(channels, prior, seed);
    for (std::size_t step = 0; step < burn_in; ++step) {
        const double done = static_cast<double>(step) / static_cast<double>(burn_in);
        chain.sweep(std::max(1.0, std::pow(100.0, 1.0 - 1.6 * done)));
    }
    std::vector<std::vector<Mode>> states;
    for (std::size_t state = 0; state < kept; ++state) {
        for (std::size_t step = 0; step < thinning; ++step) chain.sweep(1.0);
        states.push_back(chain.modes());
    }
    return states;
}

}  // namespace thermbal
