#include "injector.hpp"

#include <algorithm>
#include <utility>

namespace thermbal::soak {
namespace {

/// What a scan without a fault takes, with both turnarounds.
constexpr double clean_scan_s = 0.01;
/// Longer than FreezeWatch needs to notice a module that never repeats itself.
constexpr int frozen_scans = 12;

}  // namespace

Injector::Injector(Rig& rig, std::vector<FaultDraw> draws, double response_timeout_s, std::uint64_t seed)
    : rig_(rig), draws_(std::move(draws)), response_timeout_s_(response_timeout_s), random_(seed) {}

bool Injector::has(FaultKind kind) const {
    return std::ranges::any_of(current_, [kind](const Fault& fault) { return fault.kind == kind; });
}

void Injector::at_a_random_moment(double within_s, std::function<void()> action) {
    if (later_.joinable()) later_.join();
    const std::chrono::duration<double> wait(std::uniform_real_distribution(0.0, within_s)(random_));
    later_ = std::jthread([wait, action = std::move(action)] {
        std::this_thread::sleep_for(wait);
        action();
    });
}

void Injector::begin() {
    current_.clear();
    const int at_once = draws_.size() == 1 ? 1 : drawn(1, 3);
    bool drops_connections = false;
    for (int i = 0; i < at_once; ++i) {
        const FaultDraw& draw = draws_[random_() % draws_.size()];
        current_.push_back(draw.draw(random_, response_timeout_s_));
        drops_connections = drops_connections || draw.drops_connections;
    }
    if (drops_connections) current_.push_back({.kind = FaultKind::hang_up});
    at_a_random_moment(clean_scan_s, [this, faults = current_] {
        for (const Fault& fault : faults) rig_.begin_fault(fault);
    });
    scans_left_ = has(FaultKind::frozen) ? frozen_scans : drawn(1, 3);
    phase_ = Phase::faulty;
}

void Injector::before_scan(bool last_scan_was_clean) {
    if (phase_ == Phase::clean && --scans_left_ < 0) {
        begin();
    } else if (phase_ == Phase::faulty && --scans_left_ < 0) {
        at_a_random_moment(2.0 * response_timeout_s_, [this] { rig_.end_faults(); });
        phase_ = Phase::recovering;
    } else if (phase_ == Phase::recovering && last_scan_was_clean) {
        ++done_;
        phase_ = Phase::clean;
        scans_left_ = drawn(0, 2);
    }
}

}  // namespace thermbal::soak
