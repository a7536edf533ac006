#include "modbus/link.hpp"

#include <chrono>
#include <deque>
#include <filesystem>
#include <set>
#include <string>
#include <thread>

#include <fcntl.h>
#include <gmock/gmock.h>
#include <netinet/in.h>
#include <signal.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <termios.h>
#include <unistd.h>

#include "base/backoff.hpp"
#include "modbus/unit.hpp"
#include "scripted_peer.hpp"
#include "serial/ports.hpp"

namespace thermbal::test {
namespace {

using std::chrono::milliseconds;
using ::testing::HasSubstr;
using Send = ScriptedPeer::Send;
using HangUp = ScriptedPeer::Hang_up;

void wait(int ms) {
    std::this_thread::sleep_for(milliseconds(ms));
}

double took_s(const std::function<void()>& call) {
    const auto start = std::chrono::steady_clock::now();
    call();
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

std::vector<std::uint16_t> words_of_request(int number, int first, int count) {
    std::vector<std::uint16_t> words;
    words.reserve(static_cast<std::size_t>(count));
    for (int i = 0; i < count; ++i) words.push_back(static_cast<std::uint16_t>(number * 1000 + first + i));
    return words;
}

/// Every test of this suite runs over TCP and over RTU on a pseudo-terminal.
class LinkTest : public ::testing::TestWithParam<Transport> {
  protected:
    void start(ScriptedPeer::Script script) {
        peer_ = std::make_unique<ScriptedPeer>(GetParam(), std::move(script));
        options_ = peer_->options();
        link_ = make_link(options_);
    }

    /// Reads 8 registers; a success has to be the peer's answer to the request that it got last, whole. The
    /// call has to keep its bound. True: a good reading.
    bool read(int first = 0) {
        Result<std::vector<std::uint16_t>> words;
        const double took = took_s([&] { words = link_->read_block(1, 3, first, 8); });
        EXPECT_LE(took, longest_call_s(options_));
        if (!words) {
            message_ = words.error().message;
            next_ = words.error().next;
            return false;
        }
        EXPECT_EQ(*words, words_of_request(peer_->requests(), first, 8));
        return true;
    }

    /// One disturbed reply, then a peer that does everything right: the disturbed scan has no value, the next
    /// is clean.
    void expect_one_lost_scan(
        const std::function<void(const Heard&, const Send&, const HangUp&)>& disturbance) {
        start([=](const Heard& heard, const Send& send, const HangUp& hang_up) {
            if (heard.number == 2)
                disturbance(heard, send, hang_up);
            else
                send(heard.right_reply());
        });
        EXPECT_TRUE(read());
        EXPECT_FALSE(read(8));
        EXPECT_EQ(next_, NextStep::reopen_link) << message_;
        wait(250);
        EXPECT_TRUE(read()) << message_;
        EXPECT_TRUE(read(8)) << message_;
    }

    /// What a script is told while it runs. The peer still runs it when a test's own variables are gone.
    std::atomic<int> told_ = 0;
    std::unique_ptr<ScriptedPeer> peer_;
    LinkOptions options_;
    std::unique_ptr<Link> link_;
    std::string message_;
    NextStep next_ = NextStep::stop;
};

INSTANTIATE_TEST_SUITE_P(Lines, LinkTest,
                         ::testing::Values(Transport::tcp, Transport::rtu, Transport::rtu_over_tcp),
                         [](const auto& line) {
                             return std::string(line.param == Transport::tcp   ? "Tcp"
                                                : line.param == Transport::rtu ? "RtuOnPty"
                                                                               : "RtuOverTcp");
                         });

TEST_P(LinkTest, ReadsABlockAndCounts) {
    start([](const Heard& heard, const Send& send, const HangUp&) { send(heard.right_reply()); });
    for (int i = 0; i < 20; ++i) EXPECT_TRUE(read(i)) << message_;
    const LinkCounters counters = link_->counters();
    EXPECT_EQ(counters.requests, 20U);
    EXPECT_EQ(counters.replies, 20U);
    EXPECT_EQ(counters.connects, 1U);
}

TEST_P(LinkTest, LateReplyIsNeverTheNextReading) {
    expect_one_lost_scan([](const Heard& heard, const Send& send, const HangUp&) {
        wait(150);
        send(heard.right_reply());
    });
}

TEST_P(LinkTest, LateReplyIsNeverTheNextReadingWhenAskedAgainAtOnce) {
    // Later than the whole silence that follows a timeout, with no other reply close behind it: on RTU only
    // the different length of the probe can tell whose it is.
    start([](const Heard& heard, const Send& send, const HangUp&) {
        wait(heard.number == 2 ? 250 : 30);
        send(heard.right_reply());
    });
    EXPECT_TRUE(read());
    int good = 0;
    for (int i = 0; i < 12; ++i) good += read(8 * (i % 3)) ? 1 : 0;
    EXPECT_GE(good, 6) << message_;
    EXPECT_TRUE(read());
}

TEST_P(LinkTest, PersistentlyLatePeerNeverGivesAReadingAndHealsWhenItGetsFaster) {
    told_ = 140;  // ms
    start([this](const Heard& heard, const Send& send, const HangUp&) {
        wait(told_);
        send(heard.right_reply());
    });
    for (int i = 0; i < 8; ++i) EXPECT_FALSE(read(i));
    told_ = 0;
    wait(300);
    EXPECT_TRUE(read()) << message_;
}

TEST_P(LinkTest, APeerThatIsAlwaysTwoRepliesBehindGivesNoReading) {
    // The reply to an older probe must not pass for that to the newest one.
    start([owed = std::deque<Heard>()](const Heard& heard, const Send& send, const HangUp&) mutable {
        owed.push_back(heard);
        if (owed.size() <= 2) return;
        send(owed.front().right_reply());
        owed.pop_front();
    });
    for (int i = 0; i < 12; ++i) EXPECT_FALSE(read(8 * (i % 3))) << i;
}

TEST_P(LinkTest, SilenceIsATimeoutWithinItsBound) {
    start([](const Heard&, const Send&, const HangUp&) {});
    EXPECT_FALSE(read());
    EXPECT_THAT(message_, HasSubstr("unit 1 did not answer within 0.1 s"));
    EXPECT_EQ(link_->counters().timeouts, 1U);
    for (int i = 0; i < 3; ++i) EXPECT_FALSE(read());
}

TEST_P(LinkTest, TricklingReplyTakesNoLongerThanTheBound) {
    expect_one_lost_scan([](const Heard& heard, const Send& send, const HangUp&) {
        for (const std::uint8_t one : heard.right_reply()) {
            send({one});
            wait(15);
        }
    });
}

TEST_P(LinkTest, WrongUnit) {
    expect_one_lost_scan([](const Heard& heard, const Send& send, const HangUp&) {
        Heard other = heard;
        other.frame[heard.transport == Transport::tcp ? 6 : 0] = 2;
        send(other.right_reply());
    });
}

TEST_P(LinkTest, WrongFunction) {
    expect_one_lost_scan([](const Heard& heard, const Send& send, const HangUp&) {
        Heard other = heard;
        other.frame[heard.transport == Transport::tcp ? 7 : 1] = 4;
        send(other.right_reply());
    });
}

TEST_P(LinkTest, WrongLength) {
    expect_one_lost_scan([](const Heard& heard, const Send& send, const HangUp&) {
        Heard other = heard;
        other.frame[heard.transport == Transport::tcp ? 11 : 5] = 9;
        send(other.right_reply());
    });
}

TEST_P(LinkTest, TruncatedReply) {
    expect_one_lost_scan([](const Heard& heard, const Send& send, const HangUp&) {
        Bytes reply = heard.right_reply();
        reply.resize(reply.size() - 5);
        send(reply);
    });
}

TEST_P(LinkTest, NoiseInsteadOfAReply) {
    expect_one_lost_scan([](const Heard&, const Send& send, const HangUp&) {
        send({0x00, 0xFF, 0x55, 0xAA, 0x01, 0x03, 0xF0, 0x12, 0x34, 0x00, 0x00, 0x00, 0x07, 0x81});
    });
}

TEST_P(LinkTest, EchoOfTheRequest) {
    expect_one_lost_scan([](const Heard& heard, const Send& send, const HangUp&) { send(heard.frame); });
}

TEST_P(LinkTest, DuplicatedReplyIsNotTheNextReading) {
    start([](const Heard& heard, const Send& send, const HangUp&) {
        send(heard.right_reply());
        send(heard.right_reply());
    });
    int good = 0;
    for (int i = 0; i < 6; ++i) good += read(8 * i) ? 1 : 0;
    // read() has compared every accepted word. How many there are over TCP depends on when the second frame
    // comes.
    if (GetParam() != Transport::tcp) {
        EXPECT_EQ(good, 0) << message_;
    }
}

TEST(LinkTcp, ATruncatedReplyThatAStrayFrameCompletesIsNoReading) {
    ScriptedPeer peer(Transport::tcp, [](const Heard& heard, const Send& send, const HangUp&) {
        Bytes reply = heard.right_reply();
        if (heard.number == 2) {
            const Bytes stray = reply;
            reply.resize(reply.size() - 3);
            reply.insert(reply.end(), stray.begin(), stray.end());
        }
        send(reply);
    });
    const auto link = make_link(peer.options());
    EXPECT_TRUE(link->read_block(1, 3, 0, 8));
    EXPECT_FALSE(link->read_block(1, 3, 0, 8));
    EXPECT_TRUE(link->read_block(1, 3, 0, 8));
}

TEST_P(LinkTest, UnsolicitedFrameBetweenScansIsReadAway) {
    start([](const Heard& heard, const Send& send, const HangUp&) {
        send(heard.right_reply());
        if (heard.number != 1) return;
        wait(60);
        send(heard.right_reply());
    });
    EXPECT_TRUE(read());
    wait(150);
    EXPECT_TRUE(read(8)) << message_;
    EXPECT_GT(link_->counters().stray_bytes, 0U);
}

TEST_P(LinkTest, EveryExceptionIsAnErrorThatKeepsTheLink) {
    start([this](const Heard& heard, const Send& send, const HangUp&) {
        send(told_ == 0 ? heard.right_reply() : heard.exception(told_));
    });
    for (const int each : {1, 2, 3, 4, 5, 6, 7, 8, 10, 11, 99}) {
        told_ = each;
        EXPECT_FALSE(read());
        EXPECT_EQ(next_, NextStep::retry);
        EXPECT_THAT(message_, HasSubstr("exception " + std::to_string(each)));
        told_ = 0;
        EXPECT_TRUE(read()) << message_;
    }
    EXPECT_EQ(link_->counters().connects, 1U);
    EXPECT_EQ(link_->counters().exceptions, 11U);
}

TEST_P(LinkTest, WritesAreConfirmedOrAnError) {
    start([this](const Heard& heard, const Send& send, const HangUp&) {
        Heard answer = heard;
        const bool lies = told_ != 0;
        if (lies) answer.frame[heard.transport == Transport::tcp ? 9 : 3] ^= 1;
        const std::size_t head = heard.transport == Transport::tcp ? 7 : 1;
        send(heard.frame_around(Bytes(answer.frame.begin() + static_cast<long>(head),
                                      answer.frame.begin() + static_cast<long>(head) + 5)));
    });
    EXPECT_TRUE(link_->write_coil(1, 3, true));
    EXPECT_TRUE(link_->write_register(1, 4, 0xBEEF));
    told_ = 1;
    EXPECT_FALSE(link_->write_coil(1, 3, true));
    EXPECT_FALSE(link_->write_register(1, 4, 7));
}

TEST_P(LinkTest, ArgumentsOutsideModbusAreRefusedUnsent) {
    start([](const Heard& heard, const Send& send, const HangUp&) { send(heard.right_reply()); });
    for (const auto& result :
         {link_->read_block(1, 3, 0, 0), link_->read_block(1, 3, 0, 126), link_->read_block(1, 2, 0, 1),
          link_->read_block(1, 3, -1, 1), link_->read_block(1, 3, 65535, 2), link_->read_block(256, 3, 0, 1),
          link_->read_block(-1, 3, 0, 1)}) {
        ASSERT_FALSE(result);
        EXPECT_EQ(result.error().next, NextStep::refuse_input);
    }
    EXPECT_EQ(peer_->requests(), 0);
}

TEST(LinkTcp, WrongTransactionAndProtocolAndLengthField) {
    for (const std::size_t at : {0U, 1U, 2U, 3U, 5U}) {
        ScriptedPeer peer(Transport::tcp, [at](const Heard& heard, const Send& send, const HangUp&) {
            Bytes reply = heard.right_reply();
            if (heard.number == 1) reply[at] ^= 0x04;
            send(reply);
        });
        const auto link = make_link(peer.options());
        EXPECT_FALSE(link->read_block(1, 3, 0, 8)) << "byte " << at;
        EXPECT_TRUE(link->read_block(1, 3, 0, 8)) << "byte " << at;
        EXPECT_EQ(peer.connections(), 2);
    }
}

TEST(LinkTcp, TransactionIdsGoOnOverAReconnection) {
    std::vector<int> ids;
    ScriptedPeer peer(Transport::tcp, [&](const Heard& heard, const Send&, const HangUp& hang_up) {
        ids.push_back(heard.frame[0] << 8 | heard.frame[1]);
        hang_up();
    });
    const auto link = make_link(peer.options());
    for (int i = 0; i < 4; ++i) EXPECT_FALSE(link->read_block(1, 3, 0, 8));
    ASSERT_EQ(ids.size(), 4U);
    for (std::size_t i = 1; i < 4; ++i) EXPECT_EQ(ids[i], (ids[i - 1] + 1) % 65536);
}

TEST(LinkTcp, ConnectionThatThePeerClosedWhileIdleCostsNoReading) {
    ScriptedPeer peer(Transport::tcp, [](const Heard& heard, const Send& send, const HangUp& hang_up) {
        send(heard.right_reply());
        hang_up();
    });
    const auto link = make_link(peer.options());
    for (int i = 0; i < 5; ++i) {
        EXPECT_TRUE(link->read_block(1, 3, 0, 8));
        wait(30);
    }
    EXPECT_EQ(link->counters().connects, 5U);
}

TEST(LinkTcp, RefusedConnectionIsAnErrorAtOnceAndHealsByItself) {
    LinkOptions options;
    {
        const ScriptedPeer peer(Transport::tcp, [](const Heard&, const Send&, const HangUp&) {});
        options = peer.options();
    }
    const auto link = make_link(options);
    const auto words = link->read_block(1, 3, 0, 8);
    ASSERT_FALSE(words);
    EXPECT_EQ(words.error().next, NextStep::reopen_link);
    EXPECT_THAT(words.error().message, HasSubstr("cannot connect to 127.0.0.1 port"));
    EXPECT_EQ(link->counters().connect_failures, 1U);
}

TEST(LinkTcp, AFailedOpeningIsNotTriedAgainAtOnce) {
    LinkOptions options;
    {
        const ScriptedPeer peer(Transport::tcp, [](const Heard&, const Send&, const HangUp&) {});
        options = peer.options();
    }
    options.first_pause_s = 0.05;
    options.longest_pause_s = 0.2;
    const auto link = make_link(options);
    // Sixteen units on a line whose gateway is gone cost one attempt, not sixteen.
    for (int unit = 1; unit <= 16; ++unit) EXPECT_FALSE(link->read_block(unit, 3, 0, 8));
    EXPECT_EQ(link->counters().connect_failures, 1U);
    EXPECT_EQ(link->counters().pauses, 15U);
    const auto words = link->read_block(1, 3, 0, 8);
    ASSERT_FALSE(words);
    EXPECT_THAT(words.error().message, HasSubstr("cannot connect to 127.0.0.1 port"));
    for (int failure = 2; failure <= 5; ++failure) {
        wait(205);  // never longer than the longest pause
        EXPECT_FALSE(link->read_block(1, 3, 0, 8));
        EXPECT_EQ(link->counters().connect_failures, static_cast<std::uint64_t>(failure));
    }
}

TEST(Backoff, DoublesToTheLongestPauseWithJitter) {
    std::set<double> first;
    for (std::uint32_t seed = 1; seed <= 20; ++seed) {
        Backoff backoff(0.1, 2.0, seed);
        double nominal_s = 0.1;
        for (int failure = 0; failure < 8; ++failure) {
            const double pause_s = backoff.failed_s();
            if (failure == 0) first.insert(pause_s);
            EXPECT_GE(pause_s, 0.5 * nominal_s);
            EXPECT_LE(pause_s, nominal_s);
            nominal_s = std::min(2.0 * nominal_s, 2.0);
        }
        backoff.succeeded();
        EXPECT_LE(backoff.failed_s(), 0.1);
    }
    EXPECT_GT(first.size(), 15U) << "every line pauses for the same time";
}

TEST(LinkTcp, PeerThatNeverAcceptsKeepsTheConnectBound) {
    // A full backlog: the kernel drops further SYNs, as a gateway with one client or a dead address does.
    const int listener = socket(AF_INET, SOCK_STREAM, 0);
    ASSERT_GE(listener, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t length = sizeof address;
    ASSERT_EQ(bind(listener, reinterpret_cast<sockaddr*>(&address), length), 0);
    ASSERT_EQ(listen(listener, 0), 0);
    ASSERT_EQ(getsockname(listener, reinterpret_cast<sockaddr*>(&address), &length), 0);
    std::vector<int> fillers;
    for (int i = 0; i < 4; ++i) {
        fillers.push_back(socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK, 0));
        static_cast<void>(connect(fillers.back(), reinterpret_cast<sockaddr*>(&address), length));
    }
    wait(50);
    LinkOptions options;
    options.port = ntohs(address.sin_port);
    options.connect_timeout_s = 0.3;
    options.response_timeout_s = 0.1;
    const auto link = make_link(options);
    const double took = took_s([&] { EXPECT_FALSE(link->read_block(1, 3, 0, 8)); });
    EXPECT_LE(took, longest_call_s(options));
    EXPECT_GE(took, 0.25);
    for (const int fd : fillers) close(fd);
    close(listener);
}

TEST(LinkTcp, NamesAndUnknownNames) {
    ScriptedPeer peer(Transport::tcp,
                      [](const Heard& heard, const Send& send, const HangUp&) { send(heard.right_reply()); });
    LinkOptions options = peer.options();
    options.host = "localhost";  // may be ::1 first, where nobody listens
    EXPECT_TRUE(make_link(options)->read_block(1, 3, 0, 8));
    options.host = "no-such-host.invalid";
    const auto link = make_link(options);
    Result<std::vector<std::uint16_t>> words;
    EXPECT_LE(took_s([&] { words = link->read_block(1, 3, 0, 8); }), longest_call_s(options));
    ASSERT_FALSE(words);
    EXPECT_THAT(words.error().message, HasSubstr("no-such-host.invalid"));
}

TEST(LinkRtu, WrongCrc) {
    ScriptedPeer peer(Transport::rtu, [](const Heard& heard, const Send& send, const HangUp&) {
        Bytes reply = heard.right_reply();
        if (heard.number == 1) reply.back() ^= 0x10;
        send(reply);
    });
    const auto link = make_link(peer.options());
    const auto words = link->read_block(1, 3, 0, 8);
    ASSERT_FALSE(words);
    EXPECT_EQ(words.error().next, NextStep::reopen_link);
    EXPECT_EQ(link->counters().bad_frames, 1U);
    EXPECT_TRUE(link->read_block(1, 3, 0, 8));
}

TEST(LinkRtu, LateReplyOfOneUnitIsNoReadingOfAnother) {
    ScriptedPeer peer(Transport::rtu, [](const Heard& heard, const Send& send, const HangUp&) {
        if (heard.number == 1) wait(150);
        send(heard.right_reply());
    });
    const auto link = make_link(peer.options());
    EXPECT_FALSE(link->read_block(1, 3, 0, 8));
    const auto other = link->read_block(2, 3, 0, 8);
    ASSERT_TRUE(other) << other.error().message;
    EXPECT_EQ(*other, words_of_request(2, 0, 8));
}

TEST(LinkRtu, LineThatNeverFallsSilentKeepsTheBound) {
    std::atomic<bool> babble = true;
    ScriptedPeer peer(Transport::rtu, [&](const Heard& heard, const Send& send, const HangUp&) {
        if (heard.number > 1) return send(heard.right_reply());
        for (int i = 0; i < 200 && babble; ++i) {
            send({0x55});
            wait(4);
        }
    });
    const LinkOptions options = peer.options();
    const auto link = make_link(options);
    for (int i = 0; i < 3; ++i) {
        Result<std::vector<std::uint16_t>> words;
        EXPECT_LE(took_s([&] { words = link->read_block(1, 3, 0, 8); }), longest_call_s(options));
        EXPECT_FALSE(words);
    }
    babble = false;
    wait(150);
    EXPECT_TRUE(link->read_block(1, 3, 0, 8));
}

UnitPlan eight_inputs(bool confirm) {
    ModuleProfile profile;
    profile.inputs = 8;
    return plan_unit(1, profile, confirm);
}

std::int64_t no_clock() {
    return 0;
}

TEST(LinkRtu, ASoundFrameJustBeforeALateReplyIsNoReadingWhenReadsAreConfirmed) {
    for (const bool confirm : {false, true}) {
        ScriptedPeer peer(Transport::rtu, [](const Heard& heard, const Send& send, const HangUp&) {
            if (heard.count() == 8 && heard.number == 1) {
                Heard other = heard;
                other.number = 40;  // other temperatures
                send(other.right_reply());
                wait(50);  // longer than the silence that is asked for behind a reply
            }
            send(heard.right_reply());
        });
        const auto link = make_link(peer.options());
        const UnitReading reading = read_unit(*link, eight_inputs(confirm), no_clock);
        // Without the check there is nothing to tell the two by: this is what it is for.
        ASSERT_EQ(reading.error.has_value(), confirm);
        if (!confirm) continue;
        EXPECT_EQ(reading.error->next, NextStep::reopen_link);
        for (const Sample& sample : reading.samples) EXPECT_EQ(sample.quality, Quality::communication);
        wait(150);
        const UnitReading next = read_unit(*link, eight_inputs(true), no_clock);
        ASSERT_FALSE(next.error) << next.error->message;
        EXPECT_EQ(next.samples[0].raw, (peer.requests() - 1) * 1000) << "the reading, then its check";
    }
}

TEST(LinkRtu, AFrameInFrontOfOneOfManyBlocksIsFoundOut) {
    // One register a block: every later reply fits the next request.
    ModuleProfile profile;
    profile.inputs = 6;
    profile.stride = 256;
    ScriptedPeer peer(Transport::rtu, [](const Heard& heard, const Send& send, const HangUp&) {
        if (heard.number == 2) {
            Heard other = heard;
            other.number = 40;
            send(other.right_reply());
            wait(50);
        }
        send(heard.right_reply());
    });
    const auto link = make_link(peer.options());
    const UnitReading reading = read_unit(*link, plan_unit(1, profile, true), no_clock);
    ASSERT_TRUE(reading.error);
    for (const Sample& sample : reading.samples) EXPECT_FALSE(sample.good());
}

TEST(LinkRtu, AReadingIsNotUsedWhenWhatConfirmsItDoesNotCome) {
    ScriptedPeer peer(Transport::rtu, [&](const Heard& heard, const Send& send, const HangUp&) {
        if (heard.count() == 8) return send(heard.right_reply());
        if (heard.number < 5) send(heard.exception(2));
    });
    const auto link = make_link(peer.options());
    const UnitReading refused = read_unit(*link, eight_inputs(true), no_clock);
    ASSERT_TRUE(refused.error);
    EXPECT_THAT(refused.error->message, HasSubstr("confirm_reads = false"));
    EXPECT_FALSE(refused.samples[0].raw);
    UnitReading silent;
    EXPECT_FALSE(read_unit(*link, eight_inputs(false), no_clock).error);
    wait(20);
    EXPECT_TRUE(link->read_block(1, 3, 0, 8));
    EXPECT_LE(took_s([&] { silent = read_unit(*link, eight_inputs(true), no_clock); }),
              longest_unit_s(peer.options(), eight_inputs(true)));
    ASSERT_TRUE(silent.error);
    EXPECT_FALSE(silent.samples[0].raw);
}

TEST(LinkRtu, PortOfAnotherProgramIsNamed) {
    ScriptedPeer peer(Transport::rtu,
                      [](const Heard& heard, const Send& send, const HangUp&) { send(heard.right_reply()); });
    const auto first = make_link(peer.options());
    ASSERT_TRUE(first->read_block(1, 3, 0, 8));
    const auto second = make_link(peer.options());
    const auto words = second->read_block(1, 3, 0, 8);
    ASSERT_FALSE(words);
    EXPECT_THAT(words.error().message, HasSubstr("is in use"));
    first->close();
    EXPECT_TRUE(second->read_block(1, 3, 0, 8));
}

TEST(LinkRtu, AdapterThatComesBackUnderAnotherNameIsFoundWithinOneCall) {
    const auto right = [](const Heard& heard, const Send& send, const HangUp&) { send(heard.right_reply()); };
    auto before = std::make_unique<ScriptedPeer>(Transport::rtu, right);
    const ScriptedPeer after(Transport::rtu, right);
    LinkOptions options = before->options();
    std::string plugged_in = before->device();
    options.device.clear();
    options.find_device = [&]() -> Result<std::string> { return plugged_in; };
    const auto link = make_link(options);
    EXPECT_TRUE(link->read_block(1, 3, 0, 8));
    plugged_in = after.device();
    before.reset();
    const auto words = link->read_block(1, 3, 0, 8);
    EXPECT_TRUE(words) << words.error().message;
    EXPECT_EQ(after.requests(), 1);
}

TEST(LinkRtu, ALinkThatPointsToAnotherPortIsFollowedWithinOneCall) {
    // What udev does with /dev/serial/by-id when an adapter comes back as ttyUSB1.
    const auto right = [](const Heard& heard, const Send& send, const HangUp&) { send(heard.right_reply()); };
    auto before = std::make_unique<ScriptedPeer>(Transport::rtu, right);
    const ScriptedPeer after(Transport::rtu, right);
    const std::string by_id = std::filesystem::temp_directory_path() / ("by-id-" + std::to_string(getpid()));
    std::filesystem::create_symlink(before->device(), by_id);
    LinkOptions options = before->options();
    options.device = by_id;
    options.response_timeout_s = 1.0;
    options.longest_pause_s = options.first_pause_s = 0.02;
    const auto link = make_link(options);
    EXPECT_TRUE(link->read_block(1, 3, 0, 8));

    std::filesystem::remove(by_id);
    before.reset();
    const auto gone = link->read_block(1, 3, 0, 8);
    ASSERT_FALSE(gone);
    EXPECT_THAT(gone.error().message, HasSubstr(by_id));
    wait(25);
    std::filesystem::create_symlink(after.device(), by_id);
    const auto words = link->read_block(1, 3, 0, 8);
    EXPECT_TRUE(words) << words.error().message;
    EXPECT_EQ(after.requests(), 1);
    std::filesystem::remove(by_id);
}

TEST(LinkRtu, AnAdapterIsFoundByVidPidAndSerialAmongOthersUnderItsNewName) {
    const auto right = [](const Heard& heard, const Send& send, const HangUp&) { send(heard.right_reply()); };
    auto before = std::make_unique<ScriptedPeer>(Transport::rtu, right);
    const ScriptedPeer after(Transport::rtu, right);
    std::vector<PortInfo> plugged_in = {{.path = before->device(),
                                         .by_id_path = "",
                                         .description = "",
                                         .usb_vid = 0x0403,
                                         .usb_pid = 0x6001,
                                         .serial = "A1"},
                                        {.path = "/dev/ttyUSB7",
                                         .by_id_path = "",
                                         .description = "",
                                         .usb_vid = 0x0403,
                                         .usb_pid = 0x6001,
                                         .serial = "B2"}};
    PortSelector selector = *parse_vid_pid("0403:6001");
    selector.serial = "A1";
    LinkOptions options = before->options();
    options.device.clear();
    options.longest_pause_s = options.first_pause_s = 0.02;
    options.find_device = [&]() -> Result<std::string> {
        const auto port = match_port(plugged_in, selector);
        if (!port) return std::unexpected(port.error());
        return port->path;
    };
    const auto link = make_link(options);
    EXPECT_TRUE(link->read_block(1, 3, 0, 8));
    plugged_in.erase(plugged_in.begin());
    before.reset();
    const auto gone = link->read_block(1, 3, 0, 8);
    ASSERT_FALSE(gone);
    EXPECT_THAT(gone.error().message, HasSubstr("no serial port is USB 0403:6001, serial number A1"));
    wait(25);
    plugged_in.push_back({.path = after.device(),
                          .by_id_path = "",
                          .description = "",
                          .usb_vid = 0x0403,
                          .usb_pid = 0x6001,
                          .serial = "A1"});
    EXPECT_TRUE(link->read_block(1, 3, 0, 8));
}

TEST(LinkRtu, AnotherProcessOnThePortIsNamedHoweverItHoldsIt) {
    ScriptedPeer peer(Transport::rtu,
                      [](const Heard& heard, const Send& send, const HangUp&) { send(heard.right_reply()); });
    for (const bool with_lock_file : {false, true}) {
        int said[2];
        ASSERT_EQ(pipe(said), 0);
        const pid_t other = fork();
        if (other == 0) {
            prctl(PR_SET_NAME, "minicom-like");
            const std::string name = "/run/lock/LCK.." + std::string("pts_") +
                                     std::filesystem::path(peer.device()).filename().string();
            const int fd = open(peer.device().c_str(), O_RDWR | O_NOCTTY);
            if (with_lock_file) {
                const int lock = open(name.c_str(), O_WRONLY | O_CREAT | O_EXCL, 0644);
                dprintf(lock, "%10d\n", getpid());
            } else {
                flock(fd, LOCK_EX | LOCK_NB);
            }
            if (write(said[1], "x", 1) != 1) _exit(1);
            pause();
        }
        char ready = 0;
        ASSERT_EQ(read(said[0], &ready, 1), 1);
        LinkOptions options = peer.options();
        options.longest_pause_s = options.first_pause_s = 0.0;
        const auto link = make_link(options);
        const auto words = link->read_block(1, 3, 0, 8);
        ASSERT_FALSE(words);
        EXPECT_THAT(words.error().message,
                    HasSubstr("is in use by pid " + std::to_string(other) + " (minicom-like)"));
        kill(other, SIGKILL);
        waitpid(other, nullptr, 0);
        EXPECT_TRUE(link->read_block(1, 3, 0, 8)) << "the lock of a process that has died holds nobody up";
        close(said[0]);
        close(said[1]);
    }
}

TEST(LinkRtu, MissingPortSaysWhatToDo) {
    LinkOptions options;
    options.transport = Transport::rtu;
    options.device = "/dev/ttyThatIsNotThere0";
    const auto words = make_link(options)->read_block(1, 3, 0, 8);
    ASSERT_FALSE(words);
    EXPECT_EQ(words.error().next, NextStep::reopen_link);
    EXPECT_THAT(words.error().message, HasSubstr("/dev/ttyThatIsNotThere0: No such file or directory; plug"));
}

TEST(LinkOptions, RefusesWhatNoLineCanHave) {
    LinkOptions options;
    EXPECT_EQ(check_link_options(options), "");
    options.port = 0;
    EXPECT_THAT(check_link_options(options), HasSubstr("port is 0"));
    options = {};
    for (const char* host : {"10.0.0.7", "module-3.hall_2", "::1", "fe80::1%eth0", "2001:db8::7"}) {
        options.host = host;
        EXPECT_EQ(check_link_options(options), "") << host;
    }
    for (const char* host : {"", "127.0.0.1:502", "http://x", "a b", "[::1]", "x\n"}) {
        options.host = host;
        EXPECT_THAT(check_link_options(options), HasSubstr("host is")) << host;
    }
    options = {};
    options.transport = Transport::rtu;
    EXPECT_THAT(check_link_options(options), HasSubstr("device is empty"));
    options.device = "/dev/ttyUSB0";
    options.baud = 9601;
    EXPECT_THAT(check_link_options(options), HasSubstr("baud is 9601"));
    options.baud = 9600;
    options.response_timeout_s = std::numeric_limits<double>::quiet_NaN();
    EXPECT_THAT(check_link_options(options), HasSubstr("response_timeout_s"));
}

}  // namespace
}  // namespace thermbal::test
