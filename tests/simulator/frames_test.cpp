#include "simulator/frames.hpp"

#include <random>

#include <gmock/gmock.h>

namespace thermbal {
namespace {

using testing::ElementsAre;
using Kind = ParsedRequest::Kind;

const Bytes read_16 = {0x04, 0x00, 0x00, 0x00, 0x10};

Bytes joined(Bytes a, const Bytes& b) {
    a.insert(a.end(), b.begin(), b.end());
    return a;
}

TEST(ModbusCrc, KnownFrames) {
    // 01 03 00 00 00 0A C5 CD: a frame that every Modbus tutorial quotes.
    EXPECT_EQ(modbus_crc(Bytes{0x01, 0x03, 0x00, 0x00, 0x00, 0x0A}), 0xCDC5);
    // Check value of CRC-16/MODBUS: the digits 1 to 9.
    EXPECT_EQ(modbus_crc(Bytes{'1', '2', '3', '4', '5', '6', '7', '8', '9'}), 0x4B37);
}

TEST(TcpRequest, WholeFrame) {
    const Bytes frame = tcp_frame(0x1234, 7, read_16);
    EXPECT_THAT(frame, ElementsAre(0x12, 0x34, 0, 0, 0, 6, 7, 4, 0, 0, 0, 16));
    const ParsedRequest parsed = parse_tcp_request(frame);
    EXPECT_EQ(parsed.kind, Kind::request);
    EXPECT_EQ(parsed.consumed, frame.size());
    EXPECT_EQ(parsed.request.transaction, 0x1234);
    EXPECT_EQ(parsed.request.unit, 7);
    EXPECT_EQ(parsed.request.pdu, read_16);
}

TEST(TcpRequest, EveryPartOfAFrameWaitsForTheRest) {
    const Bytes frame = tcp_frame(1, 1, read_16);
    for (std::size_t size = 0; size < frame.size(); ++size) {
        const ParsedRequest parsed = parse_tcp_request(ByteView(frame).first(size));
        EXPECT_EQ(parsed.kind, Kind::incomplete) << size;
        EXPECT_EQ(parsed.consumed, 0U);
    }
}

TEST(TcpRequest, TwoFramesInOnePiece) {
    const Bytes first = tcp_frame(1, 1, read_16);
    const ParsedRequest parsed = parse_tcp_request(joined(first, tcp_frame(2, 1, read_16)));
    EXPECT_EQ(parsed.kind, Kind::request);
    EXPECT_EQ(parsed.consumed, first.size());
    EXPECT_EQ(parsed.request.transaction, 1);
}

TEST(TcpRequest, WhatIsNoModbusBreaksTheStream) {
    const Bytes text = {'G', 'E', 'T', ' ', '/', ' ', 'H', 'T'};
    EXPECT_EQ(parse_tcp_request(text).kind, Kind::broken);
    Bytes overlong = tcp_frame(1, 1, read_16);
    overlong[4] = 0x01;  // length 262
    EXPECT_EQ(parse_tcp_request(overlong).kind, Kind::broken);
    Bytes unit_alone = tcp_frame(1, 1, read_16);
    unit_alone[5] = 1;  // a unit and no PDU
    EXPECT_EQ(parse_tcp_request(unit_alone).kind, Kind::broken);
}

TEST(RtuRequest, WholeFrame) {
    const Bytes frame = rtu_frame(3, read_16);
    const ParsedRequest parsed = parse_rtu_request(frame, false);
    EXPECT_EQ(parsed.kind, Kind::request);
    EXPECT_EQ(parsed.consumed, 8U);
    EXPECT_EQ(parsed.request.unit, 3);
    EXPECT_EQ(parsed.request.pdu, read_16);
}

TEST(RtuRequest, EveryPartWaitsAndSilenceDropsIt) {
    const Bytes frame = rtu_frame(3, read_16);
    for (std::size_t size = 1; size < frame.size(); ++size) {
        const ByteView part = ByteView(frame).first(size);
        EXPECT_EQ(parse_rtu_request(part, false).kind, Kind::incomplete) << size;
        const ParsedRequest dropped = parse_rtu_request(part, true);
        EXPECT_EQ(dropped.kind, Kind::garbage) << size;
        EXPECT_EQ(dropped.consumed, size);
    }
}

TEST(RtuRequest, LengthOfAWriteComesFromItsByteCount) {
    const Bytes write = {0x10, 0x03, 0xE8, 0x00, 0x02, 0x04, 0x00, 0x01, 0x00, 0x02};
    const Bytes frame = rtu_frame(1, write);
    EXPECT_EQ(parse_rtu_request(ByteView(frame).first(6), false).kind, Kind::incomplete);
    EXPECT_EQ(parse_rtu_request(ByteView(frame).first(frame.size() - 1), false).kind, Kind::incomplete);
    const ParsedRequest parsed = parse_rtu_request(joined(frame, rtu_frame(1, read_16)), false);
    EXPECT_EQ(parsed.kind, Kind::request);
    EXPECT_EQ(parsed.consumed, frame.size());
    EXPECT_EQ(parsed.request.pdu, write);
}

TEST(RtuRequest, BytesBeforeAFrameAreSkipped) {
    const Bytes frame = rtu_frame(1, read_16);
    Bytes rest = joined({0x55, 0x03, 0x07}, frame);
    int skipped = 0;
    ParsedRequest parsed = parse_rtu_request(rest, false);
    while (parsed.kind == Kind::garbage) {
        rest.erase(rest.begin(), rest.begin() + static_cast<std::ptrdiff_t>(parsed.consumed));
        ++skipped;
        parsed = parse_rtu_request(rest, false);
    }
    // 03 07 01 04 ...: function 7 has four bytes, so the parser never waits for what will not come.
    EXPECT_EQ(skipped, 3);
    EXPECT_EQ(parsed.kind, Kind::request);
    EXPECT_EQ(parsed.request.pdu, read_16);
}

TEST(RtuRequest, AWrongCrcIsNoRequest) {
    Bytes frame = rtu_frame(1, read_16);
    frame[7] ^= 1U;
    EXPECT_EQ(parse_rtu_request(frame, false).kind, Kind::garbage);
}

TEST(RtuRequest, AnUnknownFunctionEndsWithTheSilence) {
    const Bytes frame = rtu_frame(1, Bytes{0x41, 0x01, 0x02});
    EXPECT_EQ(parse_rtu_request(frame, false).kind, Kind::incomplete);
    const ParsedRequest parsed = parse_rtu_request(frame, true);
    EXPECT_EQ(parsed.kind, Kind::request);
    EXPECT_EQ(parsed.request.pdu.front(), 0x41);
}

TEST(RtuRequest, AnEndlessFrameIsCutDown) {
    EXPECT_EQ(parse_rtu_request(Bytes(300, 0x41), false).kind, Kind::garbage);
    Bytes announces_260 = {1, 16, 0, 0, 0, 0x7B, 0xFF};
    EXPECT_EQ(parse_rtu_request(announces_260, false).kind, Kind::garbage);
}

/// Whatever comes, a parser either waits or makes progress, and never consumes what it did not get.
TEST(Requests, RandomBytesNeverStall) {
    std::mt19937 generator(20150101);
    std::uniform_int_distribution<int> byte(0, 255);
    std::uniform_int_distribution<int> length(0, 400);
    for (int round = 0; round < 5000; ++round) {
        Bytes bytes(static_cast<std::size_t>(length(generator)));
        for (auto& b : bytes) b = static_cast<std::uint8_t>(byte(generator));
        for (const ParsedRequest& parsed :
             {parse_tcp_request(bytes), parse_rtu_request(bytes, false), parse_rtu_request(bytes, true)}) {
            ASSERT_LE(parsed.consumed, bytes.size());
            ASSERT_EQ(parsed.kind == Kind::incomplete, parsed.consumed == 0);
            if (parsed.kind == Kind::request) {
                ASSERT_FALSE(parsed.request.pdu.empty());
            }
        }
        ASSERT_TRUE(bytes.empty() || parse_rtu_request(bytes, true).kind != Kind::incomplete);
    }
}

}  // namespace
}  // namespace thermbal
