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

}  // namespace
}  // namespace thermbal
