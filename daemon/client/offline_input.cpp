#include "offline_input.hpp"

#include <algorithm>
#include <cstdio>

#include <fmt/format.h>

#include "compute/earlier_tests.hpp"
#include "files.hpp"

namespace thermbal {

Result<OfflineInput> read_input(const OfflineOptions& options) {
    const auto text = read_file(options.file);
    if (!text) return std::unexpected(text.error());
    const auto test = parse_recorded_test(*text, options.file);
    if (!test) return std::unexpected(test.error());
    const double period_s = median_step_s(*test);
    if (period_s <= 0.0) {
        return fail(NextStep::refuse_input,
                    fmt::format("{}: one row only; expected a recorded test", options.file));
    }
    OfflineInput input{to_window(*test, period_s), {}};
    input.flow.ambient = options.ambient == "none" ? "" : options.ambient;
    input.flow.tolerance_C = options.tolerance_C;
    if (!options.archive.empty()) {
        const auto database = Reader::open(options.archive);
        if (!database) return std::unexpected(database.error());
        auto earlier = prior_of_machine(*database, options.machine, input.flow.spectrum);
        if (!earlier) return std::unexpected(earlier.error());
        if (!earlier->prior) {
            fmt::print(
                stderr,
                "thermbalctl: {}: no earlier test{} in it, going on without; a test that ends leaves one, "
                "`thermbalctl learn` adds recordings\n",
                options.archive, options.machine.empty() ? "" : " of " + options.machine);
        }
        input.flow.prior = std::move(earlier->prior);
    }
    if (options.modes_only) input.flow.sweep_when = SweepWhen::never;
    if (!input.flow.ambient.empty() && input.window.channel(input.flow.ambient) == nullptr) {
        return fail(NextStep::refuse_input,
                    fmt::format("{}: no column {}; name the ambient with --ambient, or --ambient none",
                                options.file, input.flow.ambient));
    }
    for (const std::string& channel : options.channels) {
        if (input.window.channel(channel) == nullptr) {
            return fail(NextStep::refuse_input, fmt::format("{}: no column {}", options.file, channel));
        }
        if (channel == input.flow.ambient) {
            return fail(
                NextStep::refuse_input,
                fmt::format("--channel {}: it measures the room, which is not identified; name another "
                            "channel, or another --ambient",
                            channel));
        }
    }
    return input;
}

bool is_wanted(const OfflineOptions& options, const std::string& channel) {
    return options.channels.empty() || std::ranges::find(options.channels, channel) != options.channels.end();
}

}  // namespace thermbal
