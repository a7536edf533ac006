#include "simulator/faults.hpp"

#include <gmock/gmock.h>

namespace thermbal {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

const ModbusRequest request{.transaction = 0x0102, .unit = 5, .pdu = {4, 0, 0, 0, 1}};
const Bytes reply = {4, 2, 0x01, 0x0B};

std::vector<Delivery> with(Framing framing, const char* text) {
    return deliveries(framing, request, reply, *parse_fault(text));
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

TEST(FaultText, WhatIsWrongIsRefusedAndNamed) {
    for (const char* text :
         {"", "open", "open@", "open:7@0", "open:T0@0", "open:T17@0", "late=-1@0", "silence:0@0",
          "silence:248@0", "silence=3@0", "exception=0@0", "exception=1.5@0", "open@5-5", "open@5-4",
          "open@nan", "open@-5", "gone@0", "late=1e9@0", "open@0-"}) {
        const auto fault = parse_fault(text);
        ASSERT_FALSE(fault) << text;
        EXPECT_EQ(fault.error().next, NextStep::refuse_input);
        EXPECT_THAT(fault.error().message, HasSubstr(std::string("'") + text + "'"));
    }
}

TEST(Faults, WhereAndWhen) {
    const std::vector<Fault> faults = {*parse_fault("open:T7@100-200"), *parse_fault("short@150"),
                                       *parse_fault("silence:2@50")};
    EXPECT_EQ(sensor_state(faults, 6, 99.0), SensorState::healthy);
    EXPECT_EQ(sensor_state(faults, 6, 150.0), SensorState::open);
    EXPECT_EQ(sensor_state(faults, 6, 200.0), SensorState::shorted);
    EXPECT_EQ(sensor_state(faults, 5, 149.0), SensorState::healthy);
    EXPECT_FALSE(line_fault(faults, 1, 60.0));
    EXPECT_EQ(line_fault(faults, 2, 60.0)->kind, FaultKind::silence);
}

TEST(Deliveries, WithoutAFault) {
    const auto sent = deliveries(Framing::tcp, request, reply, {});
    ASSERT_EQ(sent.size(), 1U);
    EXPECT_THAT(sent[0].bytes, ElementsAre(1, 2, 0, 0, 0, 5, 5, 4, 2, 1, 0x0B));
    EXPECT_EQ(sent[0].delay_s, 0.0);
    EXPECT_FALSE(sent[0].hang_up);
}

TEST(Deliveries, EachFaultIsWhatItSays) {
    const Bytes tcp = deliveries(Framing::tcp, request, reply, {})[0].bytes;
    const Bytes rtu = deliveries(Framing::rtu, request, reply, {})[0].bytes;
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

}  // namespace
}  // namespace thermbal
