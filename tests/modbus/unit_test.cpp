#include "modbus/unit.hpp"

#include <algorithm>

#include <gtest/gtest.h>

namespace thermbal {
namespace {

/// Registers hold their own address; fails from the given call on.
class CountingLink final : public Link {
  public:
    Result<std::vector<std::uint16_t>> read_block(int, int function, int first, int count) override {
        calls.push_back({function, first, count});
        if (static_cast<int>(calls.size()) >= fails_at) return fail(NextStep::reopen_link, "silence");
        std::vector<std::uint16_t> words;
        words.reserve(static_cast<std::size_t>(count));
        for (int i = 0; i < count; ++i) words.push_back(static_cast<std::uint16_t>(first + i));
        return words;
    }
    Result<void> write_coil(int, int, bool) override { return {}; }
    Result<void> write_register(int, int, std::uint16_t) override { return {}; }
    void close() override {}
    LinkCounters counters() const override { return {}; }

    struct Call {
        int function, first, count;
    };
    std::vector<Call> calls;
    int fails_at = 1000;
};

std::int64_t no_clock() {
    return 0;
}

TEST(Plan, OneBlockForASixteenChannelModule) {
    const auto blocks = plan_blocks(ModuleProfile{});
    ASSERT_EQ(blocks.size(), 1U);
    EXPECT_EQ(blocks[0].count, 16);
}

TEST(Plan, CoversEveryInputOnceWithinTheLimit) {
    for (const RegisterType type : {RegisterType::int16, RegisterType::float32}) {
        for (const int stride : {2, 3, 7, 124, 125, 200, 4096}) {
            ModuleProfile profile;
            profile.type = type;
            profile.stride = stride;
            profile.inputs = 11;
            profile.first_register = 5;
            int next = 0;
            for (const BlockRead& block : plan_blocks(profile)) {
                EXPECT_EQ(block.first_input, next);
                EXPECT_EQ(block.first, 5 + next * stride);
                EXPECT_LE(block.count, max_registers_per_read);
                EXPECT_EQ(block.count, (block.inputs - 1) * stride + registers_per_value(type));
                next += block.inputs;
            }
            EXPECT_EQ(next, 11);
        }
    }
}

TEST(Plan, TheConfirmingReadHasALengthThatNoBlockHas) {
    for (const RegisterType type : {RegisterType::int16, RegisterType::float32}) {
        for (const int inputs : {1, 2, 3, 8, 11, 16, 63, 126, 127, 250}) {
            for (const int stride : {2, 3, 62, 124, 256}) {
                ModuleProfile profile;
                profile.inputs = inputs;
                profile.type = type;
                profile.stride = stride;
                const UnitPlan plan = plan_unit(1, profile, true);
                ASSERT_TRUE(plan.confirming);
                EXPECT_GE(plan.confirming->first, 0);
                EXPECT_LE(plan.confirming->first + plan.confirming->count, 65536);
                for (const BlockRead& block : plan.blocks) EXPECT_NE(block.count, plan.confirming->count);
                const bool whole_values = std::ranges::any_of(plan.blocks, [&](const BlockRead& block) {
                    const int last = block.first + block.count;
                    return plan.confirming->first >= block.first &&
                           plan.confirming->first + plan.confirming->count == last &&
                           (plan.confirming->first - block.first) % stride == 0;
                });
                EXPECT_EQ(whole_values, !plan.confirming->may_be_refused) << inputs << " " << stride;
                EXPECT_FALSE(plan_unit(1, profile, false).confirming);
            }
        }
    }
}

TEST(ReadUnit, EveryInputFromItsOwnRegister) {
    ModuleProfile profile;
    profile.function = 4;
    profile.inputs = 60;
    profile.stride = 5;
    profile.first_register = 100;
    CountingLink link;
    std::int64_t clock = 0;
    const UnitReading reading = read_unit(link, plan_unit(1, profile, false), [&] { return ++clock; });
    EXPECT_EQ(link.calls.size(), 3U);
    EXPECT_EQ(link.calls[0].function, 4);
    EXPECT_FALSE(reading.error);
    EXPECT_EQ(reading.request_ns, 1);
    EXPECT_EQ(reading.reply_ns, 2);
    ASSERT_EQ(reading.samples.size(), 60U);
    for (std::size_t i = 0; i < 60; ++i) EXPECT_EQ(reading.samples[i].raw, 100 + 5 * i);
}

TEST(ReadUnit, AFailureLeavesNoNumberBehind) {
    ModuleProfile profile;
    profile.inputs = 11;
    profile.stride = 4096;
    CountingLink link;
    link.fails_at = 4;
    const UnitReading reading = read_unit(link, plan_unit(1, profile, false), no_clock);
    EXPECT_EQ(link.calls.size(), 4U);
    ASSERT_TRUE(reading.error);
    EXPECT_EQ(reading.error->next, NextStep::reopen_link);
    ASSERT_EQ(reading.samples.size(), 11U);
    for (std::size_t i = 0; i < 11; ++i) {
        EXPECT_EQ(reading.samples[i].raw.has_value(), i < 3);
        EXPECT_EQ(reading.samples[i].quality == Quality::communication, i >= 3);
    }
}

ModuleProfile with_type_codes(int stride) {
    ModuleProfile profile;
    profile.type_code = TypeCode{.function = 3, .first_register = 40, .stride = stride, .accepted = {40, 41}};
    return profile;
}

TEST(TypeCodes, OfEveryInputFromItsOwnRegister) {
    CountingLink link;
    const auto codes = read_type_codes(link, 1, with_type_codes(100));
    ASSERT_TRUE(codes);
    ASSERT_EQ(codes->size(), 16U);
    for (std::size_t input = 0; input < 16; ++input) EXPECT_EQ((*codes)[input], 40 + 100 * input);
}

TEST(TypeCodes, OneForAllInputs) {
    CountingLink link;
    const auto codes = read_type_codes(link, 1, with_type_codes(0));
    ASSERT_TRUE(codes);
    EXPECT_EQ(*codes, std::vector<std::uint16_t>(16, 40));
    ASSERT_EQ(link.calls.size(), 1U);
    EXPECT_EQ(link.calls[0].count, 1);
}

TEST(TypeCodes, AFailureIsNoCode) {
    CountingLink link;
    link.fails_at = 2;
    const auto codes = read_type_codes(link, 1, with_type_codes(100));
    ASSERT_FALSE(codes);
    EXPECT_EQ(codes.error().next, NextStep::reopen_link);
}

TEST(TypeCodes, AWrongOneIsNamedWithItsInput) {
    const ModuleProfile profile = with_type_codes(1);
    EXPECT_EQ(wrong_types(profile, std::vector<std::uint16_t>{40, 41, 40}), "");
    EXPECT_EQ(wrong_types(profile, std::vector<std::uint16_t>{40, 7, 41, 9}),
              "input 2 is set to type 7, input 4 is set to type 9; the profile reads type 40, 41");
}

}  // namespace
}  // namespace thermbal
