#include "modbus/unit.hpp"

#include <algorithm>
#include <span>
#include <utility>

namespace thermbal {
namespace {

void decode_block(const ModuleProfile& profile, const BlockRead& block,
                  std::span<const std::uint16_t> registers, std::vector<Sample>& samples) {
    for (int i = 0; i < block.inputs; ++i) {
        const auto input = static_cast<std::size_t>(i);
        const std::size_t at = std::min(registers.size(), input * static_cast<std::size_t>(profile.stride));
        samples[static_cast<std::size_t>(block.first_input + i)] = decode(profile, registers.subspan(at));
    }
}

}  // namespace

std::vector<BlockRead> plan_blocks(const ModuleProfile& profile) {
    const int width = registers_per_value(profile.type);
    const int inputs_per_block = (max_registers_per_read - width) / profile.stride + 1;
    std::vector<BlockRead> blocks;
    for (int input = 0; input < profile.inputs; input += inputs_per_block) {
        const int inputs = std::min(inputs_per_block, profile.inputs - input);
        blocks.push_back({.first = profile.first_register + input * profile.stride,
                          .count = (inputs - 1) * profile.stride + width,
                          .first_input = input,
                          .inputs = inputs});
    }
    return blocks;
}

UnitPlan plan_unit(int unit_id, ModuleProfile profile) {
    std::vector<BlockRead> blocks = plan_blocks(profile);
    return {.unit_id = unit_id, .profile = std::move(profile), .blocks = std::move(blocks)};
}

double longest_unit_s(const LinkOptions& options, const UnitPlan& plan) {
    // Only one call can fail, and it is the last one: a block that succeeds takes no longer than an exchange.
    const double exchange_s = options.response_timeout_s + options.quiet_s;
    return longest_call_s(options) + static_cast<double>(plan.blocks.size() - 1) * exchange_s;
}

UnitReading read_unit(Link& link, const UnitPlan& plan, const ClockNs& now_ns) {
    UnitReading reading;
    reading.samples.assign(
        static_cast<std::size_t>(plan.profile.inputs),
        Sample{.raw = std::nullopt, .value_C = no_value, .quality = Quality::communication});
    reading.request_ns = now_ns();
    for (const BlockRead& block : plan.blocks) {
        const auto registers = link.read_block(plan.unit_id, plan.profile.function, block.first, block.count);
        if (!registers) {
            reading.error = registers.error();
            break;
        }
        decode_block(plan.profile, block, *registers, reading.samples);
    }
    reading.reply_ns = now_ns();
    return reading;
}

}  // namespace thermbal
