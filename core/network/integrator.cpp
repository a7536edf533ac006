#include "integrator.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include <fmt/format.h>

#include "phi.hpp"

namespace thermbal {
namespace {

using Eigen::Index;

constexpr double runaway_C = 1e5;
constexpr int most_halvings = 16;
constexpr int most_switchings = 20'000;

std::unexpected<Error> run_away(double time_s) {
    return fail(NextStep::stop, fmt::format("the temperatures run away at {:.0f} s", time_s));
}

}  // namespace

Integrator::Integrator(const CompiledNetwork& network, InputSchedule& schedule, SensorChain& sensors,
                       const SimulationOptions& options)
    : network_(network),
      heat_(network, schedule),
      sensors_(sensors),
      options_(options),
      start_s_(schedule.start_s()),
      breaks_s_(schedule.jumps_s()),
      regimes_(regimes_of(network)),
      known_factors_(8) {
    for (Eigen::VectorXd* nodes : {&heat_W_, &from_slope_, &to_slope_})
        nodes->setZero(static_cast<Index>(network.node_names.size()));
    breaks_s_.insert(breaks_s_.end(), network.breaks_s.begin(), network.breaks_s.end());
}

std::vector<double> Integrator::grid(std::span<const double> sample_times_s) const {
    const double end_s = sample_times_s.empty() ? start_s_ : sample_times_s.back();
    std::vector<double> moments(sample_times_s.begin(), sample_times_s.end());
    moments.push_back(start_s_);
    std::ranges::copy_if(breaks_s_, std::back_inserter(moments),
                         [&](double time_s) { return time_s > start_s_ && time_s < end_s; });
    const auto samples_end = moments.begin() + static_cast<std::ptrdiff_t>(sample_times_s.size());
    std::sort(samples_end, moments.end());
    std::inplace_merge(moments.begin(), samples_end, moments.end());
    moments.erase(std::ranges::unique(moments).begin(), moments.end());
    return moments;
}

void Integrator::enter_regime(std::size_t regime) {
    system_ = &regimes_[regime].system;
    modal_ = system_->modal_from_temperatures(node_C_);
    for (StepFactors& known : known_factors_) known.h_s = 0.0;
}

const Integrator::StepFactors& Integrator::factors(double h_s) {
    for (const StepFactors& known : known_factors_) {
        if (known.h_s == h_s) return known;
    }
    StepFactors& made = known_factors_[oldest_factors_];
    oldest_factors_ = (oldest_factors_ + 1) % known_factors_.size();
    const Index modes = system_->rate_per_s.size();
    made.h_s = h_s;
    for (Eigen::ArrayXd* array : {&made.decay, &made.decay_half, &made.half, &made.whole, &made.second,
                                  &made.begin, &made.middle, &made.end}) {
        array->resize(modes);
    }
    for (Index i = 0; i < modes; ++i) {
        const double z = -system_->rate_per_s[i] * h_s;
        if (!network_.smooth) {
            made.decay[i] = std::exp(z);
            made.whole[i] = z == 0.0 ? h_s : h_s * std::expm1(z) / z;
            continue;
        }
        const auto phi = phi_functions<4>(z);
        made.decay[i] = phi[0];
        made.whole[i] = h_s * phi[1];
        const auto phi_half = phi_functions<4>(0.5 * z);
        made.decay_half[i] = phi_half[0];
        made.half[i] = 0.5 * h_s * phi_half[1];
        made.second[i] = 2.0 * h_s * phi[2];
        made.begin[i] = h_s * (phi[1] - 3.0 * phi[2] + 4.0 * phi[3]);
        made.middle[i] = h_s * (4.0 * phi[2] - 8.0 * phi[3]);
        made.end[i] = h_s * (4.0 * phi[3] - phi[2]);
    }
    return made;
}

void Integrator::modal_heat(double time_s, const Eigen::VectorXd& node_C, Eigen::VectorXd& modal_heat) {
    heat_.evaluate(time_s, node_C, system_->surface_W_per_K, heat_W_);
    modal_heat.noalias() = system_->to_modal * heat_W_;
}

void Integrator::exact_step(double h_s) {
    const StepFactors& f = factors(h_s);
    next_modal_ = f.decay * modal_.array() + f.whole * begin_.array();
    next_C_.noalias() = system_->to_nodal * next_modal_;
}

double Integrator::smooth_step(double from_s, double h_s) {
    const StepFactors& f = factors(h_s);
    next_modal_ = f.decay_half * modal_.array() + f.half * begin_.array();
    stage_C_.noalias() = system_->to_nodal * next_modal_;
    modal_heat(from_s + 0.5 * h_s, stage_C_, middle_);
    next_modal_ = f.decay * modal_.array() + f.whole * (2.0 * middle_ - begin_).array();
    stage_C_.noalias() = system_->to_nodal * next_modal_;
    modal_heat(from_s + h_s, stage_C_, end_);
    next_modal_ = f.decay * modal_.array() + f.begin * begin_.array() + f.middle * middle_.array() +
                  f.end * end_.array();
    next_C_.noalias() = system_->to_nodal * next_modal_;
    end_ = (f.begin - f.whole + f.second) * begin_.array() + (f.middle - f.second) * middle_.array() +
           f.end * end_.array();
    stage_C_.noalias() = system_->to_nodal * end_;
    return stage_C_.lpNorm<Eigen::Infinity>();
}

double Integrator::try_step(double from_s, double h_s) {
    if (network_.smooth) return smooth_step(from_s, h_s);
    exact_step(h_s);
    return 0.0;
}

double Integrator::past_threshold_C(std::size_t thermostat, const Eigen::VectorXd& node_C) const {
    const Thermostat& one = network_.thermostats[thermostat];
    const double temperature_C = node_C[static_cast<Index>(one.node)];
    return heat_.thermostat_on(thermostat) ? one.off_C - temperature_C : temperature_C - one.on_C;
}

double Integrator::furthest_past_threshold_C(const Eigen::VectorXd& node_C) const {
    double furthest_C = -std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < network_.thermostats.size(); ++i)
        furthest_C = std::max(furthest_C, past_threshold_C(i, node_C));
    return furthest_C;
}

double Integrator::shorten_to_switching(double from_s, double h_s) {
    double behind_C = furthest_past_threshold_C(next_C_);
    if (!(behind_C > 0.0)) return h_s;
    // Just behind the crossing, so that the next step begins switched. A straight line between the two sides
    // says where; a probe a little to the left, then one to the right, of that closes in from both.
    const double close_s = 1e-6 * options_.max_step_s;
    double before_C = furthest_past_threshold_C(node_C_), before_s = 0.0, behind_s = h_s;
    for (int round = 0; behind_s - before_s > close_s; ++round) {
        const double line_s = before_s + (behind_s - before_s) * before_C / (before_C - behind_C);
        const double aside_s = round % 2 == 0 ? 0.4 * close_s : -0.4 * close_s;
        const bool halve = round % 4 == 3 || !(before_C < 0.0);
        const double middle_s =
            halve ? 0.5 * (before_s + behind_s)
                  : std::clamp(line_s + aside_s, before_s + 0.1 * close_s, behind_s - 0.1 * close_s);
        try_step(from_s, middle_s);
        const double middle_C = furthest_past_threshold_C(next_C_);
        if (middle_C > 0.0) {
            behind_s = middle_s;
            behind_C = middle_C;
        } else {
            before_s = middle_s;
            before_C = middle_C;
        }
    }
    try_step(from_s, behind_s);
    return behind_s;
}

void Integrator::switch_thermostats(double time_s) {
    for (std::size_t i = 0; i < network_.thermostats.size(); ++i) {
        if (!(past_threshold_C(i, node_C_) > 0.0)) continue;
        const bool on = !heat_.thermostat_on(i);
        heat_.switch_thermostat(i, on);
        switchings_.push_back({time_s, network_.thermostats[i].node, on});
    }
}

void Integrator::accept(double from_s, double h_s) {
    ++steps_;
    if (sensors_.needs_slopes()) {
        // Where nothing varies within a step, the heat at its end is that at its beginning.
        if (network_.smooth)
            modal_heat(from_s + h_s, next_C_, end_);
        else
            end_ = begin_;
        const auto& rate_per_s = system_->rate_per_s;
        for (const Index node : sensors_.lagged_nodes()) {
            from_slope_[node] = system_->to_nodal.row(node).dot(begin_ - rate_per_s.cwiseProduct(modal_));
            to_slope_[node] = system_->to_nodal.row(node).dot(end_ - rate_per_s.cwiseProduct(next_modal_));
        }
        sensors_.advance({from_s, from_s + h_s, node_C_, next_C_, from_slope_, to_slope_,
                          heat_.ambient_C(from_s), heat_.ambient_C(from_s + h_s)});
    }
    node_C_.swap(next_C_);
    modal_.swap(next_modal_);
    switch_thermostats(from_s + h_s);
}

Result<void> Integrator::advance(double from_s, double to_s) {
    for (double time_s = from_s; time_s < to_s;) {
        const double left_s = to_s - time_s;
        double h_s = std::min(std::ldexp(to_s - from_s, -halvings_), left_s);
        heat_.begin_step(time_s, time_s + h_s);
        modal_heat(time_s, node_C_, begin_);
        double error_C = try_step(time_s, h_s);
        while (!(error_C <= options_.tolerance_C)) {
            if (++halvings_ > most_halvings) return run_away(time_s);
            h_s *= 0.5;
            error_C = try_step(time_s, h_s);
        }
        if (!network_.thermostats.empty()) h_s = shorten_to_switching(time_s, h_s);
        if (!(next_C_.lpNorm<Eigen::Infinity>() < runaway_C)) return run_away(time_s);
        accept(time_s, h_s);
        if (switchings_.size() > most_switchings) {
            return fail(NextStep::stop, fmt::format("a thermostat switches without end at {:.0f} s", time_s));
        }
        time_s = h_s >= left_s ? to_s : time_s + h_s;
        if (halvings_ > 0 && error_C < options_.tolerance_C / 16.0) --halvings_;
    }
    return {};
}

double Integrator::longest_step_s() const {
    // Between the ends of a step a lagging sensor sees a cubic.
    constexpr double with_lag_s = 15.0;
    if (sensors_.needs_slopes()) return std::min(with_lag_s, options_.max_step_s);
    if (network_.smooth || !network_.thermostats.empty()) return options_.max_step_s;
    return std::numeric_limits<double>::infinity();
}

bool Integrator::is_exact_throughout() const {
    return !network_.smooth && network_.thermostats.empty() && !sensors_.needs_slopes();
}

void Integrator::exact_regime(std::span<const double> moments, ExactRun& run) {
    // Heat of every interval first, so that one product takes all of it to the modes; likewise back.
    const auto intervals = static_cast<Index>(moments.size()) - 1;
    Eigen::MatrixXd modal_heat(modal_.size(), intervals);
    for (Index i = 0; i < intervals; ++i) {
        const auto at = static_cast<std::size_t>(i);
        heat_.begin_step(moments[at], moments[at + 1]);
        heat_.evaluate(moments[at], node_C_, system_->surface_W_per_K, heat_W_);
        modal_heat.col(i) = heat_W_;
        run.ambient_C.push_back(heat_.ambient_C(moments[at]));
    }
    modal_heat = system_->to_modal * modal_heat;
    Eigen::MatrixXd modal(modal_.size(), intervals + 1);
    modal.col(0) = modal_;
    for (Index i = 0; i < intervals; ++i) {
        const StepFactors& f =
            factors(moments[static_cast<std::size_t>(i) + 1] - moments[static_cast<std::size_t>(i)]);
        modal.col(i + 1) = f.decay * modal.col(i).array() + f.whole * modal_heat.col(i).array();
    }
    modal_ = modal.col(intervals);
    const Index first = static_cast<Index>(run.ambient_C.size()) - intervals;
    run.node_C.middleCols(first, intervals + 1).noalias() = system_->to_nodal * modal;
    node_C_ = run.node_C.col(first + intervals);
    steps_ += static_cast<int>(intervals);
}

Result<void> Integrator::run_exact(std::span<const double> sample_times_s, std::span<const double> moments,
                                   const AtSample& at_sample) {
    ExactRun run{Eigen::MatrixXd(node_C_.size(), static_cast<Index>(moments.size())), {}};
    run.node_C.col(0) = node_C_;
    for (std::size_t regime = 0, from = 0; regime < regimes_.size(); ++regime) {
        const double until_s = regime + 1 < regimes_.size() ? regimes_[regime + 1].from_s
                                                            : std::numeric_limits<double>::infinity();
        const auto change = std::ranges::lower_bound(moments, until_s) - moments.begin();
        const std::size_t to = std::min(static_cast<std::size_t>(change), moments.size() - 1);
        enter_regime(regime);
        if (to > from) exact_regime(moments.subspan(from, to - from + 1), run);
        from = std::max(from, to);
    }
    heat_.begin_step(moments.back(), moments.back());
    run.ambient_C.push_back(heat_.ambient_C(moments.back()));
    std::size_t sample = 0;
    for (std::size_t i = 0; i < moments.size(); ++i) {
        node_C_ = run.node_C.col(static_cast<Index>(i));
        if (!(node_C_.lpNorm<Eigen::Infinity>() < runaway_C)) return run_away(moments[i]);
        if (sample < sample_times_s.size() && sample_times_s[sample] == moments[i])
            at_sample(sample++, node_C_, run.ambient_C[i]);
    }
    return {};
}

Result<void> Integrator::run(const Eigen::VectorXd& initial_C, std::span<const double> sample_times_s,
                             const AtSample& at_sample) {
    const std::vector<double> moments = grid(sample_times_s);
    const double longest_s = longest_step_s();
    std::size_t regime = 0;
    auto sample = sample_times_s.begin();
    node_C_ = initial_C;
    if (is_exact_throughout()) return run_exact(sample_times_s, moments, at_sample);
    enter_regime(regime);
    heat_.begin_step(moments.front(), moments.front());
    sensors_.begin(moments.front(), node_C_, heat_.ambient_C(moments.front()));
    switch_thermostats(moments.front());
    for (std::size_t i = 0;; ++i) {
        if (sample != sample_times_s.end() && *sample == moments[i]) {
            heat_.begin_step(moments[i], moments[i]);
            at_sample(static_cast<std::size_t>(sample - sample_times_s.begin()), node_C_,
                      heat_.ambient_C(moments[i]));
            ++sample;
        }
        if (i + 1 == moments.size()) return {};
        while (regime + 1 < regimes_.size() && regimes_[regime + 1].from_s <= moments[i])
            enter_regime(++regime);
        const double whole_s = moments[i + 1] - moments[i];
        const double parts = std::isinf(longest_s) ? 1.0 : std::ceil(whole_s / longest_s - 1e-9);
        for (double part = 0.0; part < parts; part += 1.0) {
            const double to_s =
                part + 1.0 < parts ? moments[i] + whole_s * (part + 1.0) / parts : moments[i + 1];
            if (auto advanced = advance(moments[i] + whole_s * part / parts, to_s); !advanced)
                return advanced;
        }
    }
}

}  // namespace thermbal
