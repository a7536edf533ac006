#include "declaration/stop_rule.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace thermbal {

std::string_view to_string(ChannelState state) {
    switch (state) {
        case ChannelState::measuring:
            return "measuring";
        case ChannelState::declared:
            return "declared";
        case ChannelState::barely_warming:
            return "barely_warming";
        case ChannelState::stuck:
            return "stuck";
        case ChannelState::dead:
            return "dead";
    }
    return "measuring";
}

StopDecision decide_stop(std::span<const ChannelVerdict> verdicts, const std::vector<bool>& required,
                         double now_min, const StopOptions& options) {
    StopDecision decision;
    std::vector<std::string> broken;
    std::size_t declared = 0;
    const ChannelVerdict* newest = nullptr;
    for (std::size_t i = 0; i < verdicts.size(); ++i) {
        if (!required[i]) continue;
        const ChannelVerdict& verdict = verdicts[i];
        switch (verdict.state) {
            case ChannelState::declared:
                ++declared;
                if (newest == nullptr || verdict.stands_since_min > newest->stands_since_min)
                    newest = &verdict;
                break;
            case ChannelState::barely_warming:
                break;
            case ChannelState::stuck:
            case ChannelState::dead:
                broken.push_back(fmt::format("{} is {}", verdict.channel, to_string(verdict.state)));
                [[fallthrough]];
            case ChannelState::measuring:
                decision.waiting.push_back(verdict.channel);
                break;
        }
    }
    if (decision.waiting.empty() && newest != nullptr) {
        const double stood_min = newest->stands_since_min + options.stands_min;
        decision.stop = now_min >= stood_min;
        decision.reason =
            decision.stop
                ? fmt::format("every required channel is declared ({} channels)", declared)
                : fmt::format(
                      "every required channel is declared; {}, the last of them, is watched until {:.1f} min",
                      newest->channel, stood_min);
    } else if (!broken.empty()) {
        decision.held = broken.size() == decision.waiting.size() && declared > 0;
        decision.reason = fmt::format("{}{}: mend the sensor, make the channel not required, or stop by hand",
                                      decision.held ? "every other required channel is declared; " : "",
                                      fmt::join(broken, ", "));
    } else if (decision.waiting.empty()) {
        decision.reason = "no channel has warmed enough to declare anything";
    } else {
        decision.reason = fmt::format("waiting for {}", fmt::join(decision.waiting, ", "));
    }
    return decision;
}

}  // namespace thermbal
