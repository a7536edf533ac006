#include <gmock/gmock.h>

#include "simulator/deliveries.hpp"

namespace thermbal {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

const ModbusRequest request{.transaction = 0x0102, .unit = 5, .pdu = {4, 0, 0, 0, 1}};
const Bytes reply = {4, 2, 0x01, 0x0B};

std::vector<Delivery> with(Framing framing, const char* text, const Bytes& pdu = reply) {
    std::mt19937_64 random(1);
    const std::optional<Fault> fault = *text == 0 ? std::nullopt : std::optional(*parse_fault(text));
    return deliveries(framing, request, pdu, fault, random);
}

const FaultPlan& plan_of(std::initializer_list<const char*> texts) {
    static FaultPlan plan;
    plan.clear();
    for (const char* text : texts) plan.add(*parse_fault(text));
    return plan;
}

TEST(FaultText, KindValueTargetTimes) {
    const Fault open = *parse_fault("open:T7@3600");
    EXPECT_EQ(open.kind, FaultKind::open);
    EXPECT_EQ(open.channel, 6U);
    EXPECT_FALSE(open.active(3599.9));
    EXPECT_TRUE(open.active(3600.0));
    EXPECT_TRUE(open.active(1e9));

    const Fault exception = *parse_fault("exception=6:2@600-900");
    EXPECT_EQ(exception.value, 6.0);
    EXPECT_EQ(exception.unit, 2);
    EXPECT_TRUE(exception.active(899.9));
    EXPECT_FALSE(exception.active(900.0));
}

TEST(FaultText, WrittenAndReadAgainItIsTheSame) {
    for (const char* text : {"open:T7@0.00001657856899-0.5", "silence@3600-100000000000000000000000"}) {
        const auto fault = parse_fault(text);
        ASSERT_TRUE(fault.has_value()) << text;
        const auto again = parse_fault(to_string(*fault));
        ASSERT_TRUE(again.has_value()) << to_string(*fault);
        EXPECT_EQ(again->from_s, fault->from_s);
        EXPECT_EQ(again->to_s, fault->to_s);
    }
    EXPECT_EQ(to_string(*parse_fault("open:T7@0.00001-0.5")), "open:T7@0.00001-0.5");
}

TEST(FaultText, WhatIsWrongIsRefusedAndNamed) {
    for (const char* text : {"",
                             "open",
                             "open@",
                             "open:7@0",
                             "open:T0@0",
                             "open:T17@0",
                             "late=-1@0",
                             "silence:0@0",
                             "silence:248@0",
                             "silence=3@0",
                             "exception=0@0",
                             "exception=1.5@0",
                             "open@5-5",
                             "open@5-4",
                             "open@nan",
                             "open@-5",
                             "gone@0",
                             "late=1e9@0",
                             "open@0-",
                             "code@0",
                             "code=1.5@0",
                             "code=0x@0",
                             "code=0x1FFFFFFFF@0",
                             "noise=0@0",
                             "refuse:1@0",
                             "frozen:T1@0",
                             "frozen:0@0",
                             "trickle=-1@0"}) {
        const auto fault = parse_fault(text);
        ASSERT_FALSE(fault) << text;
        EXPECT_EQ(fault.error().next, NextStep::refuse_input);
        EXPECT_THAT(fault.error().message, HasSubstr(std::string("'") + text + "'"));
    }
}

TEST(FaultText, EveryFaultOfTheCatalogueIsReadBackAsItIsWritten) {
    for (const FaultEntry& entry : fault_catalogue()) {
        const std::string text = std::string(entry.name) + (entry.value.required ? "=7" : "") + "@10.5-20";
        const auto fault = parse_fault(text);
        ASSERT_TRUE(fault) << text;
        EXPECT_EQ(fault->kind, entry.kind);
        const Fault again = *parse_fault(to_string(*fault));
        EXPECT_EQ(again.kind, fault->kind);
        EXPECT_EQ(again.value, fault->value);
        EXPECT_EQ(again.from_s, 10.5);
        EXPECT_EQ(again.to_s, 20.0);
        EXPECT_THAT(fault_help(), HasSubstr(std::string(entry.name)));
    }
}

TEST(FaultText, CodesAreDecimalOrHexadecimal) {
    EXPECT_EQ(parse_fault("code=0x7FFF:T3@0")->value, 32767.0);
    EXPECT_EQ(parse_fault("code=-30000@0")->value, -30000.0);
}

TEST(FaultPlan, WhereAndWhen) {
    const FaultPlan& plan = plan_of({"open:T7@100-200", "short@150", "silence:2@50", "code=-5:T1@0-10"});
    EXPECT_EQ(plan.sensor_state(6, 99.0), SensorState::healthy);
    EXPECT_EQ(plan.sensor_state(6, 150.0), SensorState::open);
    EXPECT_EQ(plan.sensor_state(6, 200.0), SensorState::shorted);
    EXPECT_EQ(plan.sensor_state(5, 149.0), SensorState::healthy);
    EXPECT_EQ(plan.sensor_state(0, 0.0), SensorState::coded(0xFFFFFFFB));
    EXPECT_FALSE(plan.on_reply(1, 60.0));
    EXPECT_EQ(plan.on_reply(2, 60.0)->kind, FaultKind::silence);
}

TEST(FaultPlan, TheEndpoint) {
    const FaultPlan& plan = plan_of({"refuse@10-20", "half-open@15-25", "one-client=0.5@30", "unplug@40-50"});
    EXPECT_EQ(plan.endpoint(5.0), EndpointState{});
    EXPECT_TRUE(plan.endpoint(17.0).refuses && plan.endpoint(17.0).half_open);
    EXPECT_FALSE(plan.endpoint(20.0).refuses);
    EXPECT_EQ(plan.endpoint(30.0).one_client_hold_s, 0.5);
    EXPECT_TRUE(plan.endpoint(45.0).unplugged);
    EXPECT_TRUE(plan.watches_endpoint());
}

TEST(Deliveries, WithoutAFault) {
    const auto sent = with(Framing::tcp, "");
    ASSERT_EQ(sent.size(), 1U);
    EXPECT_THAT(sent[0].bytes, ElementsAre(1, 2, 0, 0, 0, 5, 5, 4, 2, 1, 0x0B));
    EXPECT_EQ(sent[0].delay_s, 0.0);
    EXPECT_FALSE(sent[0].hang_up);
}

TEST(Deliveries, EachFaultIsWhatItSays) {
    const Bytes tcp = with(Framing::tcp, "")[0].bytes;
    const Bytes rtu = with(Framing::rtu, "")[0].bytes;
    EXPECT_THAT(with(Framing::tcp, "silence@0"), IsEmpty());
    EXPECT_EQ(with(Framing::tcp, "exception=6@0")[0].bytes, tcp_frame(0x0102, 5, Bytes{0x84, 6}));
    EXPECT_EQ(with(Framing::rtu, "late=0.25@0")[0].bytes, rtu);
    EXPECT_EQ(with(Framing::rtu, "late=0.25@0")[0].delay_s, 0.25);
    EXPECT_TRUE(with(Framing::tcp, "hangup@0")[0].hang_up);
    EXPECT_THAT(with(Framing::rtu, "hangup@0"), IsEmpty());
    EXPECT_EQ(with(Framing::tcp, "truncated@0")[0].bytes, Bytes(tcp.begin(), tcp.end() - 3));
    EXPECT_EQ(with(Framing::tcp, "wrong-tid@0")[0].bytes, tcp_frame(0x0103, 5, reply));
    EXPECT_EQ(with(Framing::rtu, "wrong-unit@0")[0].bytes, rtu_frame(6, reply));

    const Bytes bad_crc = with(Framing::rtu, "wrong-crc@0")[0].bytes;
    EXPECT_EQ(Bytes(bad_crc.begin(), bad_crc.end() - 2), Bytes(rtu.begin(), rtu.end() - 2));
    EXPECT_NE(bad_crc, rtu);
}

TEST(Deliveries, WhatIsSoundAndStillNoAnswer) {
    const Bytes two = {4, 4, 0x01, 0x0B, 0x00, 0xFE};
    EXPECT_EQ(with(Framing::rtu, "wrong-function@0")[0].bytes, rtu_frame(5, Bytes{3, 2, 0x01, 0x0B}));
    EXPECT_EQ(with(Framing::rtu, "wrong-length@0", two)[0].bytes, rtu_frame(5, reply));
    EXPECT_EQ(with(Framing::rtu, "wrong-length@0")[0].bytes, rtu_frame(5, Bytes{4, 3, 0x01, 0x0B, 0}));
    EXPECT_EQ(with(Framing::tcp, "wrong-count@0")[0].bytes, tcp_frame(0x0102, 5, Bytes{4, 4, 0x01, 0x0B}));
    const auto unasked = with(Framing::tcp, "unsolicited=0.2@0");
    ASSERT_EQ(unasked.size(), 2U);
    EXPECT_EQ(unasked[1].delay_s, 0.2);
    EXPECT_EQ(unasked[1].bytes, tcp_frame(0x0102, 5, Bytes{4, 2, 0x01, 0x12}));
}

TEST(Deliveries, MoreThanTheReply) {
    const Bytes rtu = with(Framing::rtu, "")[0].bytes;
    const auto trickle = with(Framing::rtu, "trickle=0.1@0");
    ASSERT_EQ(trickle.size(), rtu.size());
    for (std::size_t i = 0; i < rtu.size(); ++i) {
        EXPECT_THAT(trickle[i].bytes, ElementsAre(rtu[i]));
        EXPECT_DOUBLE_EQ(trickle[i].delay_s, 0.1 * static_cast<double>(i));
    }
    const auto twice = with(Framing::rtu, "duplicate=0.3@0");
    ASSERT_EQ(twice.size(), 2U);
    EXPECT_EQ(twice[0].bytes, rtu);
    EXPECT_EQ(twice[1].bytes, rtu);
    EXPECT_EQ(twice[1].delay_s, 0.3);

    Bytes echoed = rtu_frame(5, request.pdu);
    echoed.insert(echoed.end(), rtu.begin(), rtu.end());
    EXPECT_EQ(with(Framing::rtu, "echo@0")[0].bytes, echoed);
    const Bytes noisy = with(Framing::rtu, "noise=9@0")[0].bytes;
    ASSERT_EQ(noisy.size(), rtu.size() + 9);
    EXPECT_EQ(Bytes(noisy.begin() + 9, noisy.end()), rtu);
}

TEST(Deliveries, EveryFaultOfAReplyChangesSomethingOnOneOfTheTwoFramings) {
    const Bytes two = {4, 4, 0x01, 0x0B, 0x00, 0xFE};
    for (const FaultEntry& entry : fault_catalogue()) {
        if (entry.place != FaultPlace::reply) continue;
        const std::string text = std::string(entry.name) + "@0";
        const auto same = [&](Framing framing) {
            const auto sent = with(framing, text.c_str(), two);
            return sent.size() == 1 && sent[0].bytes == with(framing, "", two)[0].bytes &&
                   sent[0].delay_s == 0.0 && !sent[0].hang_up;
        };
        EXPECT_EQ(same(Framing::tcp), entry.framing == FaultFraming::rtu) << text;
        EXPECT_EQ(same(Framing::rtu), entry.framing == FaultFraming::tcp) << text;
    }
}

}  // namespace
}  // namespace thermbal
