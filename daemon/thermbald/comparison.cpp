#include "daemon.hpp"

namespace thermbal {

// Simulation against measurement, beside the live flow: a scan is compared on a thread of its own, whose
// result comes back here as a message.

/// While a comparison is under way no other one is asked for: the next sees all that came meanwhile.
void Daemon::compare_with_model(std::int64_t scan) {
    if (!test_.model || test_.comparing) return;
    test_.comparing = true;
    comparer_->submit(test_.model->job(generation_, scan, test_.window));
}

void Daemon::take_comparison(const ComparisonResult& result) {
    if (result.generation != generation_ || !test_.model || !is_measuring(test_.state)) return;
    test_.comparing = false;
    comparison_s_.add(result.seconds);
    for (const auto& change : test_.model->take(result, test_.grid.time_s(result.scan)))
        event(change.kind, change.message, change.channel);
    server_.publish("comparison", test_.model->to_json());
    settle(test_.last_scan);
}

}  // namespace thermbal
