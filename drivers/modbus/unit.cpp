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
    const auto inputs = static_cast<std::size_t>(block.inputs);
    const auto first_input = static_cast<std::size_t>(block.first_input);
    const auto stride = static_cast<std::size_t>(profile.stride);
    for (std::size_t input = 0; input < inputs; ++input) {
        const std::size_t at = std::min(registers.size(), input * stride);
        samples[first_input + input] = decode(profile, registers.subspan(at));
    }
}

/// The fewest last values of a block whose length is that of no block; nothing when each block is one value.
std::optional<ConfirmingRead> end_of_a_block(const ModuleProfile& profile,
                                             std::span<const BlockRead> blocks) {
    const int width = registers_per_value(profile.type);
    const BlockRead& longest = *std::ranges::max_element(blocks, {}, &BlockRead::count);
    for (int values = 1; values < longest.inputs; ++values) {
        const int count = (values - 1) * profile.stride + width;
        if (std::ranges::find(blocks, count, &BlockRead::count) != blocks.end()) continue;
        return ConfirmingRead{.first = longest.first + longest.count - count, .count = count};
    }
    return std::nullopt;
}

ConfirmingRead confirming_read(const ModuleProfile& profile, std::span<const BlockRead> blocks) {
    if (const auto end = end_of_a_block(profile, blocks)) return *end;
    // Half of a value that has halves, or a value and the register behind (before) it.
    const BlockRead& block = blocks.back();
    const int count = block.count == 1 ? 2 : 1;
    return {.first = std::min(block.first, 65536 - count), .count = count, .may_be_refused = true};
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

UnitPlan plan_unit(int unit_id, ModuleProfile profile, bool confirm) {
    std::vector<BlockRead> blocks = plan_blocks(profile);
    std::optional<ConfirmingRead> confirming;
    if (confirm) confirming = confirming_read(profile, blocks);
    return {.unit_id = unit_id,
            .profile = std::move(profile),
            .blocks = std::move(blocks),
            .confirming = confirming};
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
    const auto stride = static_cast<std::size_t>(map.stride);
    std::vector<std::uint16_t> codes;
    for (const BlockRead& block : plan_blocks(map)) {
        const auto words = link.read_block(unit_id, map.function, block.first, block.count);
        if (!words) return std::unexpected(words.error());
        const auto inputs = static_cast<std::size_t>(block.inputs);
        for (std::size_t input = 0; input < inputs; ++input) codes.push_back((*words)[input * stride]);
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
    const double exchange_s = options.response_timeout_s + options.quiet_s;
    const std::size_t type_reads =
        plan.profile.type_code ? plan_blocks(type_code_map(plan.profile)).size() : 0;
    const std::size_t further_reads = plan.blocks.size() - 1 + (plan.confirming ? 1 : 0) + type_reads;
    return longest_call_s(options) + static_cast<double>(further_reads) * exchange_s;
}

namespace {

std::vector<Sample> nothing_read(const ModuleProfile& profile) {
    return std::vector<Sample>(
        static_cast<std::size_t>(profile.inputs),
        Sample{.raw = std::nullopt, .value_C = no_value, .quality = Quality::communication});
}

/// Why the blocks that were read are not to be used; nothing when they are.
std::optional<Error> doubt_behind_blocks(Link& link, const UnitPlan& plan) {
    const ConfirmingRead& read = *plan.confirming;
    const auto answer = link.read_block(plan.unit_id, plan.profile.function, read.first, read.count);
    if (answer) return std::nullopt;
    const bool refused = answer.error().next == NextStep::retry;
    if (refused && read.may_be_refused) return std::nullopt;
    return Error{
        .next = answer.error().next,
        .message = fmt::format("the reading is not used, the read behind it that confirms it failed{}: "
                               "{}",
                               refused ? " (a module that cannot answer to it needs confirm_reads = "
                                         "false on its line)"
                                       : "",
                               answer.error().message)};
}

/// Decodes block by block; the first failure ends it.
std::optional<Error> read_blocks(Link& link, const UnitPlan& plan, std::vector<Sample>& samples) {
    for (const BlockRead& block : plan.blocks) {
        const auto registers = link.read_block(plan.unit_id, plan.profile.function, block.first, block.count);
        if (!registers) return registers.error();
        decode_block(plan.profile, block, *registers, samples);
    }
    return std::nullopt;
}

}  // namespace

UnitReading read_unit(Link& link, const UnitPlan& plan, const ClockNs& now_ns) {
    UnitReading reading;
    reading.samples = nothing_read(plan.profile);
    reading.request_ns = now_ns();
    reading.error = read_blocks(link, plan, reading.samples);
    if (plan.confirming) {
        // An exception to a block leaves the order of the replies as it was; anything else does not.
        const bool in_doubt = reading.error && reading.error->next != NextStep::retry;
        if (auto doubt = in_doubt ? reading.error : doubt_behind_blocks(link, plan)) {
            reading.error = std::move(doubt);
            reading.samples = nothing_read(plan.profile);
        }
    }
    reading.reply_ns = now_ns();
    return reading;
}

}  // namespace thermbal
