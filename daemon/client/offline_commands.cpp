#include <chrono>
#include <memory>

#include "commands.hpp"
#include "compare.hpp"
#include "manual/flags.hpp"
#include "offline.hpp"

namespace thermbal {
namespace {

constexpr char group[] = "On a recorded test";

void add_recording_flags(CLI::App& command, OfflineOptions& options) {
    command.add_option("FILE", options.file, "recorded test: CSV, first column time_s, then T1 ... T16")
        ->required();
    command.add_option("--ambient", options.ambient, "channel that measures the room, or none")
        ->capture_default_str();
    command.add_option("--channel", options.channels, "report only this channel; may be given several times");
    command.add_option("--archive", options.archive, "database with earlier tests of the same machine");
    command.add_option("--machine", options.machine, "whose earlier tests in the archive");
    command
        .add_option("--tolerance-C", options.tolerance_C, "half width of the 90 % interval that is asked for")
        ->capture_default_str()
        ->check(number_in(0.01, 10.0));
    command.add_option("--threads", options.threads, "compute threads")
        ->capture_default_str()
        ->check(CLI::Range(1, 256));
    command.add_flag("--json", options.json, "one JSON document on standard output");
}

void add_modes_only_flag(CLI::App& command, OfflineOptions& options) {
    command.add_flag("--modes-only", options.modes_only,
                     "a study: the shared modes alone, without the SVR criterion");
}

}  // namespace

void add_offline_commands(CLI::App& app, int& status) {
    const auto identify = std::make_shared<OfflineOptions>();
    CLI::App& identify_command = *app.add_subcommand("identify", "identify a recorded test once");
    identify_command.group(group);
    add_recording_flags(identify_command, *identify);
    add_modes_only_flag(identify_command, *identify);
    identify_command.add_option("--until-min", identify->until_min, "use only the samples up to this time")
        ->check(number_in(0.0, 1e9));
    identify_command.callback([&status, identify] { status = run_identify(*identify); });

    const auto replay = std::make_shared<OfflineOptions>();
    CLI::App& replay_command =
        *app.add_subcommand("replay", "run the growing window as the daemon would have");
    replay_command.group(group);
    add_recording_flags(replay_command, *replay);
    add_modes_only_flag(replay_command, *replay);
    replay_command
        .add_option("--every-min", replay->every_min, "minutes of samples between two identifications")
        ->capture_default_str()
        ->check(number_in(0.01, 1e6));
    replay_command.callback([&status, replay] { status = run_replay(*replay); });

    const auto compare = std::make_shared<CompareOptions>();
    compare->recording.every_min = 10.0;
    CLI::App& compare_command = *app.add_subcommand(
        "compare", "every estimator at every window of a complete recording, against its end");
    compare_command.group(group);
    add_recording_flags(compare_command, compare->recording);
    compare_command
        .add_option("--every-min", compare->recording.every_min, "minutes of samples between two windows")
        ->capture_default_str()
        ->check(number_in(0.01, 1e6));
    compare_command.add_option("--estimator", compare->estimators,
                               "only this one, several times for several: svr (slow), one_exponential, "
                               "two_exponentials, kalman, modes, modes_and_svr, modes_with_archive");
    compare_command.add_option("--plot", compare->plot, "draw the errors into this .html or .svg");
    compare_command.callback([&status, compare] { status = run_compare(*compare); });

    const auto learn = std::make_shared<LearnOptions>();
    CLI::App& learn_command = *app.add_subcommand(
        "learn", "put what complete recorded tests teach about a machine into an archive");
    learn_command.group(group);
    learn_command.add_option("FILE", learn->files, "recorded tests of the machine, measured to their end")
        ->required();
    learn_command.add_option("--archive", learn->archive, "database, made if it is not there")->required();
    learn_command.add_option("--machine", learn->machine, "the machine's name");
    learn_command.add_option("--ambient", learn->ambient, "channel that measures the room, or none")
        ->capture_default_str();
    learn_command.callback([&status, learn] {
        learn->now_wall_ns = std::chrono::duration_cast<std::chrono::nanoseconds>(
                                 std::chrono::system_clock::now().time_since_epoch())
                                 .count();
        status = run_learn(*learn);
    });
}

}  // namespace thermbal
