#include "modbus/profile.hpp"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace thermbal {
namespace {

using Words = std::vector<std::uint16_t>;

ModuleProfile profile_of(RegisterType type, ByteOrder order, double scale) {
    ModuleProfile profile;
    profile.type = type;
    profile.byte_order = order;
    profile.scale = scale;
    profile.stride = registers_per_value(type);
    return profile;
}

void expect_good(const ModuleProfile& profile, const Words& words, double value_C, std::uint32_t raw) {
    const Sample sample = decode(profile, words);
    EXPECT_EQ(sample.quality, Quality::good);
    EXPECT_DOUBLE_EQ(sample.value_C, value_C);
    EXPECT_EQ(sample.raw, raw);
}

void expect_fault(const ModuleProfile& profile, const Words& words, Quality quality) {
    const Sample sample = decode(profile, words);
    EXPECT_EQ(sample.quality, quality);
    EXPECT_TRUE(std::isnan(sample.value_C));
    EXPECT_TRUE(sample.raw.has_value());
}

TEST(Decode, Sixteen) {
    const ModuleProfile tenths = profile_of(RegisterType::int16, ByteOrder::abcd, 0.1);
    expect_good(tenths, {0x00FA}, 25.0, 0x00FA);
    expect_good(tenths, {0xFF38}, -20.0, 0xFF38);
    EXPECT_EQ(decode(tenths, Words{304}).value_C, 30.4) << "which 304 * 0.1 is not";
    expect_good(profile_of(RegisterType::int16, ByteOrder::badc, 0.1), {0xFA00}, 25.0, 0xFA00);
    expect_good(profile_of(RegisterType::uint16, ByteOrder::abcd, 0.01), {0x8000}, 327.68, 0x8000);
}

TEST(Decode, ThirtyTwoBitsInEveryOrder) {
    // 123456 * 0.001 = 123.456 and the float 26.7 = 0x41D5999A.
    struct Case {
        ByteOrder order;
        Words integer;
        Words real;
    };
    const Case cases[] = {{ByteOrder::abcd, {0x0001, 0xE240}, {0x41D5, 0x999A}},
                          {ByteOrder::cdab, {0xE240, 0x0001}, {0x999A, 0x41D5}},
                          {ByteOrder::badc, {0x0100, 0x40E2}, {0xD541, 0x9A99}},
                          {ByteOrder::dcba, {0x40E2, 0x0100}, {0x9A99, 0xD541}}};
    for (const Case& each : cases) {
        for (const RegisterType type : {RegisterType::int32, RegisterType::uint32}) {
            const Sample sample = decode(profile_of(type, each.order, 0.001), each.integer);
            EXPECT_DOUBLE_EQ(sample.value_C, 123.456);
            EXPECT_EQ(sample.raw, static_cast<std::uint32_t>(each.integer[0]) << 16 | each.integer[1]);
        }
        EXPECT_FLOAT_EQ(
            static_cast<float>(decode(profile_of(RegisterType::float32, each.order, 1.0), each.real).value_C),
            26.7F);
    }
    EXPECT_DOUBLE_EQ(
        decode(profile_of(RegisterType::int32, ByteOrder::abcd, 0.1), Words{0xFFFF, 0xFF38}).value_C, -20.0);
}

TEST(Decode, FaultCodesComeFirst) {
    ModuleProfile profile = profile_of(RegisterType::int16, ByteOrder::abcd, 0.1);
    profile.faults = {{.first = 30000, .last = 30000, .quality = Quality::open},
                      {.first = -30000, .last = -30000, .quality = Quality::shorted},
                      {.first = 6000, .last = 6500, .quality = Quality::stale}};
    expect_fault(profile, {30000}, Quality::open);
    expect_fault(profile, {static_cast<std::uint16_t>(-30000)}, Quality::shorted);
    expect_fault(profile, {6000}, Quality::stale);
    expect_fault(profile, {6500}, Quality::stale);
    expect_good(profile, {5999}, 599.9, 5999);
}

TEST(Decode, ValidRange) {
    ModuleProfile profile = profile_of(RegisterType::int16, ByteOrder::abcd, 0.1);
    profile.valid_min_C = -20.0;
    profile.valid_max_C = 60.0;
    expect_good(profile, {600}, 60.0, 600);
    expect_fault(profile, {601}, Quality::over_range);
    expect_good(profile, {static_cast<std::uint16_t>(-200)}, -20.0, 0xFF38);
    expect_fault(profile, {static_cast<std::uint16_t>(-201)}, Quality::under_range);
}

TEST(Decode, FloatsThatAreNoTemperature) {
    const ModuleProfile profile = profile_of(RegisterType::float32, ByteOrder::abcd, 1.0);
    expect_fault(profile, {0x7FC0, 0x0000}, Quality::open);         // quiet NaN
    expect_fault(profile, {0xFF80, 0x0001}, Quality::open);         // signalling NaN, negative
    expect_fault(profile, {0x7F80, 0x0000}, Quality::over_range);   // +infinity
    expect_fault(profile, {0xFF80, 0x0000}, Quality::under_range);  // -infinity
    expect_fault(profile, {0x7F7F, 0xFFFF}, Quality::over_range);   // the largest float
}

TEST(Decode, TooFewRegistersAreNoReading) {
    const Sample sample = decode(profile_of(RegisterType::float32, ByteOrder::abcd, 1.0), Words{0x41D5});
    EXPECT_EQ(sample.quality, Quality::communication);
    EXPECT_FALSE(sample.raw.has_value());
}

TEST(Decode, RandomWordsAreGoodOnlyWithinTheRange) {
    std::mt19937 random(1);
    std::uniform_int_distribution<int> word(0, 65535);
    int good = 0;
    for (int round = 0; round < 200000; ++round) {
        ModuleProfile profile =
            profile_of(static_cast<RegisterType>(round % 5), static_cast<ByteOrder>(round / 5 % 4),
                       round % 3 == 0 ? 0.1 : 0.001);
        profile.faults = {{.first = 100, .last = 200, .quality = Quality::shorted}};
        const Sample sample = decode(profile, Words{static_cast<std::uint16_t>(word(random)),
                                                    static_cast<std::uint16_t>(word(random))});
        ASSERT_EQ(sample.quality == Quality::good, std::isfinite(sample.value_C));
        if (!sample.good()) continue;
        ++good;
        ASSERT_GE(sample.value_C, profile.valid_min_C);
        ASSERT_LE(sample.value_C, profile.valid_max_C);
    }
    EXPECT_GT(good, 1000);
}

TEST(Encode, IsTheInverseOfDecode) {
    for (int type = 0; type < 5; ++type) {
        for (int order = 0; order < 4; ++order) {
            const ModuleProfile profile =
                profile_of(static_cast<RegisterType>(type), static_cast<ByteOrder>(order), 0.1);
            for (const double value_C : {0.0, 18.0, 26.7, 124.3}) {
                EXPECT_NEAR(decode(profile, encode(profile, value_C)).value_C, value_C, 1e-4);
            }
        }
    }
}

TEST(Profile, EveryFieldIsChecked) {
    const ModuleProfile right;
    EXPECT_EQ(check_profile(right), "");
    const auto refused = [&](auto change) {
        ModuleProfile profile = right;
        change(profile);
        return !check_profile(profile).empty();
    };
    EXPECT_TRUE(refused([](ModuleProfile& p) { p.function = 1; }));
    EXPECT_TRUE(refused([](ModuleProfile& p) { p.inputs = 0; }));
    EXPECT_TRUE(refused([](ModuleProfile& p) { p.stride = 0; }));
    EXPECT_TRUE(
        refused([](ModuleProfile& p) { p.type = RegisterType::float32; }));  // stride 1 is too short for it
    EXPECT_TRUE(refused([](ModuleProfile& p) { p.first_register = 65530; }));
    EXPECT_TRUE(refused([](ModuleProfile& p) { p.scale = 0.0; }));
    EXPECT_TRUE(refused([](ModuleProfile& p) { p.scale = no_value; }));
    EXPECT_TRUE(refused([](ModuleProfile& p) { p.valid_min_C = 900.0; }));
    EXPECT_TRUE(refused([](ModuleProfile& p) { p.nan_quality = Quality::good; }));
    EXPECT_TRUE(refused([](ModuleProfile& p) { p.faults = {{2.0, 1.0, Quality::open}}; }));
}

}  // namespace
}  // namespace thermbal
