#include "simulator/module.hpp"

#include <gmock/gmock.h>

namespace thermbal {
namespace {

using testing::ElementsAre;

ModuleInputs sixteen_inputs() {
    ModuleInputs inputs;
    for (int k = 0; k < 16; ++k) {
        inputs.value_C.push_back(20.0 + k);
        inputs.state.push_back(SensorState::healthy);
    }
    return inputs;
}

ModbusModule two_units() {
    return {*find_register_map("int16"),
            {{.id = 1, .first_channel = 0, .channels = 8}, {.id = 2, .first_channel = 8, .channels = 8}}};
}

ModuleReply ask(ModbusModule& module, std::uint8_t unit, Bytes pdu) {
    return module.answer({.transaction = 1, .unit = unit, .pdu = std::move(pdu)}, sixteen_inputs);
}

TEST(Module, ReadsBothTablesOfEachUnit) {
    ModbusModule module = two_units();
    EXPECT_THAT(ask(module, 1, {4, 0, 0, 0, 2}).pdu, ElementsAre(4, 4, 0, 200, 0, 210));
    EXPECT_THAT(ask(module, 2, {3, 0, 7, 0, 1}).pdu, ElementsAre(3, 2, 350 >> 8, 350 & 0xFF));
    EXPECT_THAT(ask(module, 2, {3, 0, 7, 0, 1}).words, ElementsAre(350));
}

TEST(Module, IllegalFunction) {
    ModbusModule module = two_units();
    EXPECT_THAT(ask(module, 1, {0x2B, 0x0E, 1, 0}).pdu, ElementsAre(0xAB, 1));
    ModbusModule holding_only(
        {*find_register_map("comwintop-8pt"), {{.id = 1, .first_channel = 0, .channels = 8}}});
    EXPECT_THAT(ask(holding_only, 1, {4, 0, 0, 0, 8}).pdu, ElementsAre(0x84, 1));
}

TEST(Module, IllegalAddress) {
    ModbusModule module = two_units();
    EXPECT_THAT(ask(module, 1, {4, 0, 0, 0, 9}).pdu, ElementsAre(0x84, 2));
    EXPECT_THAT(ask(module, 1, {4, 0, 8, 0, 1}).pdu, ElementsAre(0x84, 2));
    EXPECT_THAT(ask(module, 1, {4, 0xFF, 0xFF, 0, 2}).pdu, ElementsAre(0x84, 2));
    EXPECT_THAT(ask(module, 1, {5, 0, 16, 0xFF, 0}).pdu, ElementsAre(0x85, 2));
    EXPECT_THAT(ask(module, 1, {6, 0, 0, 0, 1}).pdu, ElementsAre(0x86, 2));
}

TEST(Module, IllegalQuantityOrValue) {
    ModbusModule module = two_units();
    EXPECT_THAT(ask(module, 1, {4, 0, 0, 0, 0}).pdu, ElementsAre(0x84, 3));
    EXPECT_THAT(ask(module, 1, {3, 0, 0, 0, 126}).pdu, ElementsAre(0x83, 3));
    EXPECT_THAT(ask(module, 1, {4, 0, 0}).pdu, ElementsAre(0x84, 3));
    EXPECT_THAT(ask(module, 1, {5, 0, 0, 0x12, 0x34}).pdu, ElementsAre(0x85, 3));
    EXPECT_THAT(ask(module, 1, {16, 3, 0xE8, 0, 2, 2, 0, 1}).pdu, ElementsAre(0x90, 3));
    EXPECT_THAT(ask(module, 1, {16, 3, 0xE8, 0, 1, 2, 0}).pdu, ElementsAre(0x90, 3));
    EXPECT_THAT(ask(module, 1, {15, 0, 0, 0, 9, 1, 0xFF}).pdu, ElementsAre(0x8F, 3));
}

TEST(Module, WritesAreKeptPerUnitAndTold) {
    ModbusModule module = two_units();
    const ModuleReply stopped = ask(module, 1, {5, 0, 0, 0, 0});
    EXPECT_THAT(stopped.pdu, ElementsAre(5, 0, 0, 0, 0));
    ASSERT_TRUE(stopped.write);
    EXPECT_TRUE(stopped.write->coils);
    EXPECT_EQ(stopped.write->address, 0);
    EXPECT_THAT(stopped.write->values, ElementsAre(0));
    EXPECT_THAT(ask(module, 1, {1, 0, 0, 0, 1}).pdu, ElementsAre(1, 1, 0));
    EXPECT_THAT(ask(module, 2, {1, 0, 0, 0, 1}).pdu, ElementsAre(1, 1, 1));

    EXPECT_THAT(ask(module, 2, {16, 0x03, 0xE9, 0, 2, 4, 0, 7, 1, 0}).pdu, ElementsAre(16, 0x03, 0xE9, 0, 2));
    EXPECT_THAT(ask(module, 2, {6, 0x03, 0xE8, 0x12, 0x34}).pdu, ElementsAre(6, 0x03, 0xE8, 0x12, 0x34));
    EXPECT_THAT(ask(module, 2, {3, 0x03, 0xE8, 0, 3}).words, ElementsAre(0x1234, 7, 256));
    EXPECT_THAT(ask(module, 1, {3, 0x03, 0xE8, 0, 3}).words, ElementsAre(0, 0, 0));

    EXPECT_THAT(ask(module, 1, {15, 0, 2, 0, 10, 2, 0x55, 0x03}).pdu, ElementsAre(15, 0, 2, 0, 10));
    EXPECT_THAT(ask(module, 1, {1, 0, 0, 0, 16}).pdu, ElementsAre(1, 2, 0x54, 0x0D));
}

TEST(Module, ARefusedWriteChangesNothing) {
    ModbusModule module = two_units();
    EXPECT_THAT(ask(module, 1, {16, 0x03, 0xF7, 0, 2, 4, 0, 7, 0, 7}).pdu, ElementsAre(0x90, 2));
    EXPECT_THAT(ask(module, 1, {3, 0x03, 0xF7, 0, 1}).words, ElementsAre(0));
}

TEST(Module, TypeCodesCanBeReadBack) {
    ModbusModule module({*find_register_map("mb8art"), {{.id = 9, .first_channel = 0, .channels = 8}}});
    EXPECT_THAT(ask(module, 9, {3, 0, 128, 0, 2}).words, ElementsAre(0x0200, 0x0200));
    EXPECT_THAT(ask(module, 9, {3, 0, 76, 0, 1}).words, ElementsAre(0));
    EXPECT_THAT(ask(module, 9, {3, 0, 0, 0, 1}).pdu, ElementsAre(0x83, 2));
}

TEST(Module, ABeginningScanIsAReadOfTheVeryFirstRegister) {
    const ModbusModule module = two_units();
    const auto begins = [&module](std::uint8_t unit, Bytes pdu) {
        return module.begins_scan({.transaction = 0, .unit = unit, .pdu = std::move(pdu)});
    };
    EXPECT_TRUE(begins(1, {4, 0, 0, 0, 8}));
    EXPECT_TRUE(begins(1, {3, 0, 0, 0, 1}));
    EXPECT_FALSE(begins(1, {4, 0, 1, 0, 7}));
    EXPECT_FALSE(begins(2, {4, 0, 0, 0, 8}));
    EXPECT_FALSE(begins(1, {1, 0, 0, 0, 8}));
    EXPECT_FALSE(begins(1, {4, 0, 0}));
}

}  // namespace
}  // namespace thermbal
