#include "modbus/unit.hpp"

#include <algorithm>
#include <span>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

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

namespace {

/// The type codes as if they were readings, so that the fewest reads cover them.
ModuleProfile type_code_map(const ModuleProfile& profile) {
    ModuleProfile map;
    map.function = profile.type_code->function;
    map.first_register = profile.type_code->first_register;
    map.inputs = profile.type_code->stride == 0 ? 1 : profile.inputs;
    map.stride = std::max(profile.type_code->stride, 1);
    map.type = RegisterType::uint16;
    return map;
}

}  // namespace

Result<std::vector<std::uint16_t>> read_type_codes(Link& link, int unit_id, const ModuleProfile& profile) {
    const ModuleProfile map = type_code_map(profile);
    std::vector<std::uint16_t> codes;
    for (const BlockRead& block : plan_blocks(map)) {
        const auto words = link.read_block(unit_id, map.function, block.first, block.count);
        if (!words) return std::unexpected(words.error());
        for (int input = 0; input < block.inputs; ++input)
            codes.push_back((*words)[static_cast<std::size_t>(input * map.stride)]);
    }
    codes.resize(static_cast<std::size_t>(profile.inputs), codes.back());
    return codes;
}

std::string wrong_types(const ModuleProfile& profile, std::span<const std::uint16_t> codes) {
    const std::vector<int>& accepted = profile.type_code->accepted;
    std::string wrong;
    for (std::size_t input = 0; input < codes.size(); ++input) {
        if (std::ranges::find(accepted, static_cast<int>(codes[input])) != accepted.end()) continue;
        wrong +=
            fmt::format("{}input {} is set to type {}", wrong.empty() ? "" : ", ", input + 1, codes[input]);
    }
    if (!wrong.empty()) wrong += fmt::format("; the profile reads type {}", fmt::join(accepted, ", "));
    return wrong;
}

double longest_unit_s(const LinkOptions& options, const UnitPlan& plan) {
    // Only one call can fail, and it is the last one: a block that succeeds takes no longer than an exchange.
    const double exchange_s =
        (options.confirm_reads ? 2.0 : 1.0) * (options.response_timeout_s + options.quiet_s);
    const std::size_t type_reads =
        plan.profile.type_code ? plan_blocks(type_code_map(plan.profile)).size() : 0;
    return longest_call_s(options) + static_cast<double>(plan.blocks.size() - 1 + type_reads) * exchange_s;
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
