#pragma once

#include <cstddef>
#include <deque>

#include "store/feed.hpp"

namespace thermbal {

/// What is on its way to a broker, and how far back to begin again when the connection is lost. No clock of
/// its own: `now_s` comes from the caller and never falls. One thread.
///
/// A broker that acknowledged a message and then died may have lost it (mosquitto acknowledges before it
/// writes to its disk). So what is acknowledged counts as settled only `settle_s` later; a lost connection
/// begins again after the newest settled message. Every message arrives at least once as long as the broker
/// keeps its promises within that time.
class Outbox {
  public:
    Outbox(FeedPosition settled, double settle_s) : settled_(std::move(settled)), settle_s_(settle_s) {}

    /// `after`: the position of everything up to this message. In the order of sending.
    void sent(int message_id, FeedPosition after);
    void acknowledged(int message_id, double now_s);
    /// What is acknowledged for long enough moves the settled position.
    void settle(double now_s);
    /// The connection is gone: nothing is on its way, and sending begins again after settled().
    void lost();

    const FeedPosition& settled() const { return settled_; }
    std::size_t in_flight() const { return in_flight_.size(); }

  private:
    struct Sent {
        int message_id;
        bool acknowledged;
        FeedPosition after;
    };
    struct Acknowledged {
        double at_s;
        FeedPosition after;
    };
    void keep_acknowledged(FeedPosition after, double now_s);

    FeedPosition settled_;
    double settle_s_;
    std::deque<Sent> in_flight_;
    std::deque<Acknowledged> acknowledged_;  ///< about one a second
};

}  // namespace thermbal
