#include "declaration/declarations.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

namespace thermbal {
namespace {

/// Why `declared` cannot stand any more beside what is known now; nullopt when it can.
std::optional<std::string> contradiction(const ChannelVerdict& declared, const ChannelVerdict& now,
                                         double regime_since_min) {
    if (regime_since_min > declared.declared_at_min) {
        return fmt::format("the regime changed at {:.1f} min, after the declaration at {:.1f} min",
                           regime_since_min, declared.declared_at_min);
    }
    if (now.state == ChannelState::dead || now.state == ChannelState::stuck) return std::nullopt;
    // The declared interval and the one of a longer window may differ at their edges; they may not be apart.
    if (now.steady_state_low_C > declared.steady_state_high_C ||
        now.steady_state_high_C < declared.steady_state_low_C) {
        return fmt::format(
            "{:.2f} to {:.2f} C was declared at {:.1f} min, {:.2f} to {:.2f} C is known at {:.1f} min",
            declared.steady_state_low_C, declared.steady_state_high_C, declared.declared_at_min,
            now.steady_state_low_C, now.steady_state_high_C, now.window_end_min);
    }
    return std::nullopt;
}

}  // namespace

std::vector<DeclarationChange> Declarations::update(const std::vector<ChannelVerdict>& fresh,
                                                    double regime_since_min) {
    std::vector<DeclarationChange> changes;
    std::vector<ChannelVerdict> next;
    for (const ChannelVerdict& now : fresh) {
        const auto before = std::ranges::find(standing_, now.channel, &ChannelVerdict::channel);
        if (before != standing_.end() && before->declared()) {
            const auto why = contradiction(*before, now, regime_since_min);
            if (!why) {
                next.push_back(*before);
                continue;
            }
            changes.push_back({DeclarationChange::Kind::withdrawn, now.channel, *why});
            ChannelVerdict measured_on = now;
            if (measured_on.declared()) {
                measured_on.state = ChannelState::measuring;  // a new declaration wants a window of its own
                measured_on.declared_at_min = std::numeric_limits<double>::quiet_NaN();
                measured_on.reason = "an earlier declaration was withdrawn: " + *why;
            }
            next.push_back(std::move(measured_on));
            continue;
        }
        if (now.declared()) changes.push_back({DeclarationChange::Kind::declared, now.channel, now.reason});
        next.push_back(now);
    }
    standing_ = std::move(next);
    return changes;
}

std::set<std::string> Declarations::declared_channels() const {
    std::set<std::string> channels;
    for (const ChannelVerdict& verdict : standing_) {
        if (verdict.declared()) channels.insert(verdict.channel);
    }
    return channels;
}

void Declarations::restore(std::vector<ChannelVerdict> declared) {
    standing_ = std::move(declared);
}

}  // namespace thermbal
