#include "publish/outbox.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace thermbal {

void Outbox::sent(int message_id, FeedPosition after) {
    in_flight_.push_back({message_id, false, std::move(after)});
}

void Outbox::acknowledged(int message_id, double now_s) {
    const auto found = std::ranges::find_if(
        in_flight_, [&](const Sent& sent) { return !sent.acknowledged && sent.message_id == message_id; });
    if (found == in_flight_.end()) return;  // of a message that nobody counts: a retained status
    found->acknowledged = true;
    while (!in_flight_.empty() && in_flight_.front().acknowledged) {
        keep_acknowledged(std::move(in_flight_.front().after), now_s);
        in_flight_.pop_front();
    }
}

void Outbox::keep_acknowledged(FeedPosition after, double now_s) {
    // A backlog is acknowledged by the thousand; one position for each second is enough to begin again from.
    if (!acknowledged_.empty() && std::floor(acknowledged_.back().at_s) == std::floor(now_s))
        acknowledged_.back() = {now_s, std::move(after)};
    else
        acknowledged_.push_back({now_s, std::move(after)});
}

void Outbox::settle(double now_s) {
    while (!acknowledged_.empty() && now_s - acknowledged_.front().at_s >= settle_s_) {
        settled_ = std::move(acknowledged_.front().after);
        acknowledged_.pop_front();
    }
}

void Outbox::lost() {
    in_flight_.clear();
    acknowledged_.clear();
}

}  // namespace thermbal
