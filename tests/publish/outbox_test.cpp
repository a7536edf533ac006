#include "publish/outbox.hpp"

#include <map>
#include <random>
#include <set>

#include <gmock/gmock.h>

namespace thermbal {
namespace {

FeedPosition at(std::int64_t scan) {
    FeedPosition position;
    position.test_id = 1;
    position.scan = scan;
    return position;
}

TEST(Outbox, APositionSettlesInOrderAndAfterItsTime) {
    Outbox outbox(at(-1), 60.0);
    for (int k = 0; k < 3; ++k) outbox.sent(100 + k, at(k));
    outbox.acknowledged(102, 5.0);
    outbox.settle(1000.0);
    EXPECT_EQ(outbox.settled().scan, -1) << "what went before it is not acknowledged";
    outbox.acknowledged(100, 10.0);
    outbox.acknowledged(101, 20.0);
    EXPECT_EQ(outbox.in_flight(), 0U);
    outbox.settle(69.0);
    EXPECT_EQ(outbox.settled().scan, -1);
    outbox.settle(70.0);
    EXPECT_EQ(outbox.settled().scan, 0);
    outbox.settle(80.0);
    EXPECT_EQ(outbox.settled().scan, 2);
}

TEST(Outbox, ALostConnectionBeginsAgainAfterWhatHasSettled) {
    Outbox outbox(at(-1), 60.0);
    outbox.sent(1, at(0));
    outbox.acknowledged(1, 0.0);
    outbox.settle(61.0);
    outbox.sent(2, at(1));
    outbox.acknowledged(2, 61.0);
    outbox.sent(3, at(2));
    outbox.lost();
    outbox.settle(1000.0);
    EXPECT_EQ(outbox.settled().scan, 0) << "acknowledged too recently: the broker may have died with it";
    EXPECT_EQ(outbox.in_flight(), 0U);
    outbox.acknowledged(3, 1000.0);  // of the connection that is gone
    outbox.settle(2000.0);
    EXPECT_EQ(outbox.settled().scan, 0);
}

/// A broker that acknowledges at once, forgets when it dies what it took in the last 10 s, and dies at
/// random: a sender that follows the outbox still brings everything.
TEST(Outbox, WhatABrokerForgetsIsSentAgain) {
    std::mt19937 random(20261122);
    for (int run = 0; run < 50; ++run) {
        Outbox outbox(at(-1), 11.0);
        std::map<std::int64_t, double> kept;  // scan -> when it arrived
        std::int64_t next = 0;
        int message = 0;
        double now_s = 0.0;
        const auto send_up_to = [&](std::int64_t last) {
            for (; next <= last; ++next) {
                outbox.sent(++message, at(next));
                kept.try_emplace(next, now_s);
                outbox.acknowledged(message, now_s);
            }
        };
        for (std::int64_t scan = 0; scan < 200; ++scan) {
            now_s += 1.0;
            outbox.settle(now_s);
            if (std::uniform_int_distribution(0, 19)(random) == 0) {
                std::erase_if(kept, [&](const auto& one) { return one.second > now_s - 10.0; });
                outbox.lost();
                next = outbox.settled().scan + 1;
            }
            send_up_to(scan);
        }
        ASSERT_EQ(kept.size(), 200U) << "run " << run;
    }
}

}  // namespace
}  // namespace thermbal
