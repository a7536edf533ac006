#include "simulator/register_map.hpp"

#include <cmath>
#include <limits>

#include <gmock/gmock.h>

namespace thermbal {
namespace {

using testing::ElementsAre;

RegisterMap map(const char* name, WordOrder order = WordOrder::abcd) {
    RegisterMap found = *find_register_map(name);
    found.word_order = order;
    return found;
}

TEST(RegisterMap, TenthsInSixteenBits) {
    EXPECT_THAT(encode_channel(map("int16"), 26.7, SensorState::healthy), ElementsAre(267));
    EXPECT_THAT(encode_channel(map("int16"), -12.3, SensorState::healthy), ElementsAre(0xFF85));
    EXPECT_THAT(encode_channel(map("int16"), 1e9, SensorState::healthy), ElementsAre(0x7FFF));
}

TEST(RegisterMap, FaultCodesOfRealModules) {
    EXPECT_THAT(encode_channel(map("mb8art"), 20.0, SensorState::open), ElementsAre(30000));
    EXPECT_THAT(encode_channel(map("mb8art"), 20.0, SensorState::shorted), ElementsAre(0x8AD0));
    EXPECT_THAT(encode_channel(map("comwintop-8pt"), 20.0, SensorState::open), ElementsAre(0x7FFF));
    EXPECT_THAT(encode_channel(map("comwintop-8pt"), 20.0, SensorState::shorted), ElementsAre(0x8000));
    EXPECT_THAT(encode_channel(map("wb-mai11"), 20.0, SensorState::open), ElementsAre(0x7FFF));
}

TEST(RegisterMap, ASourceWithoutAValueIsAnOpenSensor) {
    const double nothing = std::numeric_limits<double>::quiet_NaN();
    EXPECT_THAT(encode_channel(map("int16"), nothing, SensorState::healthy), ElementsAre(0x7FFF));
}

TEST(RegisterMap, FloatInEveryWordOrder) {
    // 26.5 is 0x41D40000, 26.7 nearest float 0x41D5999A.
    EXPECT_THAT(encode_channel(map("float32"), 26.7, SensorState::healthy), ElementsAre(0x41D5, 0x999A));
    EXPECT_THAT(encode_channel(map("float32", WordOrder::cdab), 26.7, SensorState::healthy),
                ElementsAre(0x999A, 0x41D5));
    EXPECT_THAT(encode_channel(map("float32", WordOrder::badc), 26.7, SensorState::healthy),
                ElementsAre(0xD541, 0x9A99));
    EXPECT_THAT(encode_channel(map("float32", WordOrder::dcba), 26.7, SensorState::healthy),
                ElementsAre(0x9A99, 0xD541));
}

TEST(RegisterMap, HundredthsInThirtyTwoBits) {
    EXPECT_THAT(encode_channel(map("int32"), -0.01, SensorState::healthy), ElementsAre(0xFFFF, 0xFFFF));
    EXPECT_THAT(encode_channel(map("int32", WordOrder::cdab), 700.0, SensorState::healthy),
                ElementsAre(0x1170, 0x0001));
}

TEST(RegisterMap, PlacesOfChannels) {
    const RegisterMap wb = map("wb-mai11");
    EXPECT_EQ(wb.place(0x1504, 11)->channel, 0U);
    EXPECT_EQ(wb.place(0xB504, 11)->channel, 10U);
    EXPECT_FALSE(wb.place(0x1505, 11));
    EXPECT_FALSE(wb.place(0xC504, 11));
    EXPECT_EQ(map("float32").place(5, 16)->channel, 2U);
    EXPECT_EQ(map("float32").place(5, 16)->word, 1U);
    EXPECT_FALSE(map("int16").place(8, 8));
}

}  // namespace
}  // namespace thermbal
