#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "modbus/link.hpp"
#include "modbus/profile.hpp"

namespace thermbal {

/// One read request: `count` registers from `first` on, which hold `inputs` inputs from `first_input`
/// (0-based) on.
struct BlockRead {
    int first = 0;
    int count = 0;
    int first_input = 0;
    int inputs = 0;
};

/// The fewest reads of at most 125 registers that cover the inputs; an input never straddles two reads.
std::vector<BlockRead> plan_blocks(const ModuleProfile& profile);

/// The read behind the blocks of a unit that shows that their replies were theirs. RTU has no transaction
/// id: a sound frame that was under way (an older reply, one that nobody asked for) passes for the reply to a
/// block, and every reply behind it is then taken for that of the request after its own. A unit answers in
/// order, so the reply to a last request of a length that no block has cannot be mistaken: when it comes
/// next, no reply was out of place.
struct ConfirmingRead {
    int first = 0;
    int count = 0;
    /// The module may not have these registers (no block holds two values): an exception is an answer, too.
    bool may_be_refused = false;
};

/// What is read of one unit at every scan. Plain data; make it once with plan_unit.
struct UnitPlan {
    int unit_id = 1;
    ModuleProfile profile;
    std::vector<BlockRead> blocks;
    std::optional<ConfirmingRead> confirming;
};

UnitPlan plan_unit(int unit_id, ModuleProfile profile, bool confirm);

/// One unit at one scan: a sample an input, always profile.inputs of them. With an error (of the first block
/// that failed) the inputs of the failed and the following blocks are Quality::communication without a raw
/// register; all inputs are where the blocks are confirmed and any doubt came up.
struct UnitReading {
    std::vector<Sample> samples;
    std::optional<Error> error;
    std::int64_t request_ns = 0;  ///< the clock before the first request
    std::int64_t reply_ns = 0;    ///< the clock after the last reply, or after the failure
};

/// The type code of each input, as the module holds it now. REQUIRES: profile.type_code.
Result<std::vector<std::uint16_t>> read_type_codes(Link& link, int unit_id, const ModuleProfile& profile);

/// Which inputs are set to a sensor that the profile does not read, one sentence; empty when none is.
std::string wrong_types(const ModuleProfile& profile, std::span<const std::uint16_t> codes);

using ClockNs = std::function<std::int64_t()>;

/// No read_unit takes longer than this, whatever the other side does.
double longest_unit_s(const LinkOptions& options, const UnitPlan& plan);

/// Reads a unit once: at most longest_unit_s. A clean failure in the middle ends it: the rest is not asked
/// for.
UnitReading read_unit(Link& link, const UnitPlan& plan, const ClockNs& now_ns);

}  // namespace thermbal
