#include "declaration/declarations.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "series/sample.hpp"

namespace thermbal {
namespace {

/// What the room alone has moved the steady state by since (gain 1): no fault of the declaration.
double room_moved_C(const ChannelVerdict& declared, const ChannelVerdict& now) {
    const double moved_C = now.room_C - declared.room_C;
    return std::isfinite(moved_C) ? moved_C : 0.0;
}

std::string then_and_now(const ChannelVerdict& declared, const ChannelVerdict& now) {
    const double room_C = room_moved_C(declared, now);
    return fmt::format(
        "{:.2f} to {:.2f} C was declared at {:.1f} min, {:.2f} to {:.2f} C is known at {:.1f} min{}",
        declared.steady_state_low_C, declared.steady_state_high_C, declared.declared_at_min,
        now.steady_state_low_C, now.steady_state_high_C, now.window_end_min,
        room_C == 0.0 ? "" : fmt::format(" (the room {:+.2f} C since)", room_C));
}

/// The declared interval and the one of a longer window may differ at their edges; they may not be apart.
bool apart(const ChannelVerdict& declared, const ChannelVerdict& now) {
    const double room_C = room_moved_C(declared, now);
    return now.steady_state_low_C - room_C > declared.steady_state_high_C ||
           now.steady_state_high_C - room_C < declared.steady_state_low_C;
}

/// What is known now, itself within the tolerance, leaves out what was declared.
bool known_better(const ChannelVerdict& declared, const ChannelVerdict& now) {
    const double half_C = 0.5 * (now.steady_state_high_C - now.steady_state_low_C);
    const double off_C = std::abs(now.steady_state_C - declared.steady_state_C - room_moved_C(declared, now));
    return half_C <= now.tolerance_C && off_C > half_C && off_C > declared.tolerance_C;
}

ChannelVerdict measured_on(const ChannelVerdict& now, const std::string& why) {
    ChannelVerdict verdict = now;
    if (!now.declared()) return verdict;
    verdict.state = ChannelState::measuring;  // a new declaration wants a window of its own
    verdict.declared_at_min = verdict.stands_since_min = no_value;
    verdict.reason = "an earlier declaration was withdrawn: " + why;
    return verdict;
}

/// The sweep is not run again on a declared channel: its curve and its guard are those of the declaration.
ChannelVerdict renewed(const ChannelVerdict& declared, const ChannelVerdict& now) {
    ChannelVerdict verdict = now;
    verdict.stands_since_min = declared.stands_since_min;
    verdict.n = declared.n;
    verdict.window_rmse_C = declared.window_rmse_C;
    verdict.rmse_by_n_C = declared.rmse_by_n_C;
    verdict.svr = declared.svr;
    for (const Guard& guard : declared.guards) {
        if (std::ranges::find(now.guards, guard.name, &Guard::name) == now.guards.end())
            verdict.guards.push_back(guard);
    }
    return verdict;
}

}  // namespace

std::string_view to_string(DeclarationChange::Kind kind) {
    switch (kind) {
        case DeclarationChange::Kind::declared:
            return "declared";
        case DeclarationChange::Kind::renewed:
            return "renewed";
        case DeclarationChange::Kind::withdrawn:
            return "withdrawn";
    }
    return "withdrawn";
}

std::vector<DeclarationChange> Declarations::update(const std::vector<ChannelVerdict>& fresh,
                                                    double last_change_min, Renewals renewals) {
    std::vector<DeclarationChange> changes;
    std::vector<ChannelVerdict> next;
    const auto change = [&](DeclarationChange::Kind kind, const ChannelVerdict& now, std::string reason,
                            ChannelVerdict verdict) {
        changes.push_back({kind, now.channel, std::move(reason)});
        next.push_back(std::move(verdict));
    };
    for (const ChannelVerdict& now : fresh) {
        const auto before = std::ranges::find(standing_, now.channel, &ChannelVerdict::channel);
        if (before == standing_.end() || !before->declared()) {
            if (now.declared())
                changes.push_back({DeclarationChange::Kind::declared, now.channel, now.reason});
            next.push_back(now);
            continue;
        }
        // A sensor that no longer reads says nothing about what was declared.
        const bool reads = now.state != ChannelState::dead && now.state != ChannelState::stuck;
        const bool better = reads && renewals == Renewals::wanted && known_better(*before, now);
        if (last_change_min > before->declared_at_min) {
            const std::string why = fmt::format(
                "the machine's inputs or its room changed at {:.1f} min, after the declaration at {:.1f} min",
                last_change_min, before->declared_at_min);
            change(DeclarationChange::Kind::withdrawn, now, why, measured_on(now, why));
        } else if (better && now.declared()) {
            change(DeclarationChange::Kind::renewed, now, then_and_now(*before, now), renewed(*before, now));
        } else if (better || (reads && apart(*before, now))) {
            const std::string why = then_and_now(*before, now);
            change(DeclarationChange::Kind::withdrawn, now, why, measured_on(now, why));
        } else {
            next.push_back(*before);
        }
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
