#include "modbus/frame.hpp"

#include <random>

#include <gtest/gtest.h>

namespace thermbal {
namespace {

using Bytes = std::vector<std::uint8_t>;

// The example of the Modbus Application Protocol V1.1b3, 6.3: registers 107 to 109 are 555, 0 and 100.
TEST(Frame, ExampleOfTheStandard) {
    const Request request{.unit_id = 17, .function = 3, .address = 107, .count_or_value = 3};
    EXPECT_EQ(request_pdu(request), (Bytes{0x03, 0x00, 0x6B, 0x00, 0x03}));
    EXPECT_EQ(tcp_frame(0x1501, request),
              (Bytes{0x15, 0x01, 0x00, 0x00, 0x00, 0x06, 0x11, 0x03, 0x00, 0x6B, 0x00, 0x03}));
    const Bytes reply{0x03, 0x06, 0x02, 0x2B, 0x00, 0x00, 0x00, 0x64};
    const auto words = check_reply(request, reply);
    ASSERT_TRUE(words);
    EXPECT_EQ(*words, (std::vector<std::uint16_t>{555, 0, 100}));
}

TEST(Frame, EveryChangedHeaderByteIsRefused) {
    const Request request{.unit_id = 1, .function = 3, .address = 0, .count_or_value = 1};
    const Bytes right{0x12, 0x34, 0, 0, 0, 5, 1, 3, 2, 0x00, 0xFA};
    ASSERT_TRUE(pdu_of_tcp_reply(right, 0x1234, 1).has_value());
    for (std::size_t at = 0; at < 9; ++at) {
        for (int bit = 0; bit < 8; ++bit) {
            Bytes wrong = right;
            wrong[at] = static_cast<std::uint8_t>(wrong[at] ^ (1 << bit));
            const auto pdu = pdu_of_tcp_reply(wrong, 0x1234, 1);
            EXPECT_FALSE(pdu && check_reply(request, *pdu)) << "byte " << at << " bit " << bit;
        }
    }
}

TEST(Frame, RandomBytesAreAnErrorOrAWholeReply) {
    std::mt19937 random(20151);
    std::uniform_int_distribution<int> byte(0, 255);
    std::uniform_int_distribution<std::size_t> length(0, 260);
    for (int round = 0; round < 20000; ++round) {
        Bytes frame(length(random));
        for (std::uint8_t& value : frame) value = static_cast<std::uint8_t>(byte(random));
        // Half of them with a head that fits, so that what is behind it gets looked at.
        if (round % 2 == 0 && frame.size() > 3) {
            frame[0] = 1;
            frame[1] = 3;
        }
        const Request request{.unit_id = 1, .function = 3, .address = 0, .count_or_value = 1 + round % 125};
        const auto pdu = pdu_of_rtu_reply(frame, 1);
        const auto words = pdu ? check_reply(request, *pdu)
                               : Result<std::vector<std::uint16_t>>(std::unexpected(pdu.error()));
        if (words) {
            EXPECT_EQ(words->size(), static_cast<std::size_t>(request.count_or_value));
        } else {
            EXPECT_FALSE(words.error().message.empty());
        }
    }
}

}  // namespace
}  // namespace thermbal
