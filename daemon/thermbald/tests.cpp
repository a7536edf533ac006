#include <algorithm>
#include <utility>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "compute/earlier_tests.hpp"
#include "compute/flow_options.hpp"
#include "config/load.hpp"
#include "config/model_file.hpp"
#include "daemon.hpp"
#include "report/spectrum_json.hpp"
#include "report/verdict_json.hpp"
#include "watches.hpp"

namespace thermbal {
namespace {

/// A week: every missed scan of it becomes a row. A clock that was wrong, once it is set, says decades.
constexpr std::int64_t longest_standstill_of_test_ns = 7 * 86'400'000'000'000;

std::string describe_source(const Config& config, const ChannelConfig& channel) {
    const UnitConfig& unit = config.units[channel.unit];
    return fmt::format("line {}, unit {} (id {}), input {}", config.lines[unit.line].link.name, unit.name,
                       unit.unit_id, channel.input);
}

std::string describe(const ChannelRecord& channel) {
    return fmt::format("{} ({}{}{})", channel.name, channel.source, channel.calibration.empty() ? "" : ", ",
                       channel.calibration);
}

/// Where a test's samples would be of something else than they were; empty: nowhere. Roles, places and which
/// channels are required may change within a test.
std::string difference_of_setup(const TestRecord& begun, const TestRecord& now) {
    if (begun.period_s != now.period_s)
        return fmt::format("test.period_s was {} and is {}", begun.period_s, now.period_s);
    for (std::size_t i = 0; i < std::max(begun.channels.size(), now.channels.size()); ++i) {
        const std::string was = i < begun.channels.size() ? describe(begun.channels[i]) : "none";
        const std::string is = i < now.channels.size() ? describe(now.channels[i]) : "none";
        if (was != is) return fmt::format("channel {} was {} and is {}", i + 1, was, is);
    }
    return {};
}

}  // namespace

TestRecord Daemon::test_record(const std::string& name, const std::string& machine,
                               const TestModel* model) const {
    const Config& config = options_.config;
    TestRecord record{.name = name,
                      .machine = machine,
                      .config_toml = explain_config(config),
                      .version = options_.version,
                      .period_s = config.test.period_s,
                      .keep_measuring = config.test.keep_measuring,
                      .started = now(),
                      .boot_id = options_.boot_id,
                      .channels = {}};
    for (const ChannelConfig& channel : config.channels) {
        record.channels.push_back({channel.name,
                                   channel.role == ChannelConfig::Role::ambient ? "ambient" : "structure",
                                   channel.place, channel.required, describe_source(config, channel),
                                   describe(channel.calibration)});
    }
    if (model != nullptr) {
        record.model_toml = model->toml;
        record.model_file = model->file;
    }
    return record;
}

Result<TestId> Daemon::start_test(TestPlan plan) {
    const auto& [name, machine, inputs, model] = plan;
    const TestRecord record = test_record(name, machine, model ? &*model : nullptr);
    storage_.flush();
    if (!storage_.problem().empty()) {
        return fail(NextStep::retry,
                    fmt::format("no test is begun while the database takes nothing: {}", storage_.problem()));
    }
    const auto id = storage_.store().begin_test(record);
    if (!id) return id;

    test_ = LiveTest{};
    test_.id = *id;
    test_.state = TestState::running;
    test_.name = name;
    test_.started_wall_ns = record.started.wall_ns;
    test_.grid = {record.started.monotonic_ns, period_ns_of(record.period_s)};
    test_.inputs = inputs;
    if (model) test_.model.emplace(*model);
    begin_window(record.period_s);
    follow_grid(test_.grid, 0);
    prepare_flow(machine);
    event("started", fmt::format("test {} \"{}\" of {}{}", *id, name,
                                 machine.empty() ? "a machine without name" : machine,
                                 model ? ", compared with model " + model->file : ""));
    return id;
}

/// The live flow's options for this test, with what earlier tests of the machine say.
void Daemon::prepare_flow(const std::string& machine) {
    auto flow = std::make_shared<FlowOptions>(flow_options(options_.config.identification));
    if (const auto ambient = options_.config.ambient())
        flow->ambient = options_.config.channels[*ambient].name;
    test_.machine = machine;
    if (!machine.empty()) {
        auto earlier = prior_of_machine(storage_.store().read(), machine, flow->spectrum);
        if (!earlier) {
            event("archive_unread", earlier.error().message);
        } else if (earlier->prior) {
            flow->prior = std::move(earlier->prior);
            event("archive", fmt::format("{} earlier tests of {} are the prior", earlier->tests, machine));
        }
    }
    test_.flow = std::move(flow);
}

/// What this test has taught about the machine, for the next one: what it knew, so nothing where it ended
/// before every required channel was declared, or all but those whose sensors are broken.
void Daemon::archive_test() {
    const bool knew_its_end = test_.decision.stop || test_.decision.held;
    if (!test_.spectrum || test_.state != TestState::stopped || !knew_its_end) return;
    const ArchiveRecord record{.id = 0,
                               .machine = test_.machine,
                               .test_id = test_.id,
                               .created_wall_ns = clock_.wall_ns(),
                               .spectrum_json = spectrum_to_json(*test_.spectrum).dump()};
    write([record](Store& store) -> Result<void> {
        const auto stored = store.record_archive(record);
        return stored ? Result<void>() : std::unexpected(stored.error());
    });
}

void Daemon::begin_window(double period_s) {
    test_.window = TestWindow{0.0, period_s, 0, {}, {}};
    for (const ChannelConfig& channel : options_.config.channels)
        test_.window.channels.push_back({channel.name, {}});
    newest_good_C_.assign(options_.config.channels.size(), no_value);
    alarm_watch_.emplace(alarm_limits(options_.config), options_.config.channels.size());
    time_watch_ = TimeWatch();
}

/// The test that was open when the daemon ended, if there was one, with the scans that are stored. After an
/// error there is none.
Result<std::optional<ResumedTest>> Daemon::take_up_test() {
    auto resumed = storage_.store().resume();
    if (!resumed || !*resumed) return resumed;
    const TestRecord& begun = (*resumed)->test.record;
    const std::string difference =
        difference_of_setup(begun, test_record(begun.name, begun.machine, nullptr));
    if (!difference.empty()) {
        return fail(NextStep::refuse_input,
                    fmt::format("test {} \"{}\" is still open and was begun with another set-up: {}. Put the "
                                "configuration back to go on with it, or end it: thermbald --abort-test",
                                (*resumed)->test.id, begun.name, difference));
    }
    if (auto restored = restore(**resumed); !restored) {
        test_ = LiveTest{};
        return std::unexpected(restored.error());
    }
    return resumed;
}

Result<void> Daemon::restore(const ResumedTest& resumed) {
    const StoredTest& stored = resumed.test;
    const TestRecord& record = stored.record;
    test_ = LiveTest{};
    test_.id = stored.id;
    test_.state = stored.state;
    test_.name = record.name;
    test_.started_wall_ns = record.started.wall_ns;
    test_.grid = {record.started.monotonic_ns, period_ns_of(record.period_s)};
    const std::int64_t last_scan = stored.last_scan.value_or(-1);
    if (record.boot_id != options_.boot_id) {
        // Another boot, another monotonic clock: the wall clock says how long the test has been going.
        const std::int64_t elapsed_ns = clock_.wall_ns() - record.started.wall_ns;
        test_.grid.start_ns = clock_.monotonic_ns() - elapsed_ns;
        if (test_.grid.scan_at(clock_.monotonic_ns()) <= last_scan) {
            // The wall clock was set back meanwhile. Go on behind what is stored; how long the gap was is not
            // known.
            test_.grid.start_ns = clock_.monotonic_ns() - (last_scan + 1) * test_.grid.period_ns;
        }
    }

    test_.decision.reason = stored.stop_reason;
    begin_window(record.period_s);
    const std::size_t channels = options_.config.channels.size();
    const auto read = storage_.store().read().each_scan(stored.id, 0, INT64_MAX, [&](ScanRecord& scan) {
        Scan again{.scan = scan.scan, .samples = std::move(scan.samples)};
        again.samples.resize(channels);
        for (const InputValue& input : scan.inputs) set_input({input.name, input.value});
        // Only so that they go on where they were: a frozen module is known, what was an alarm has ended the
        // test then.
        freeze_watch_.take(again);
        alarm_watch_->take(test_.grid.time_s(again.scan), again.samples);
        grow_window(again);
    });
    if (!read) return read;
    std::vector<ChannelVerdict> verdicts;
    for (const IdentificationRecord& identification : resumed.identifications) {
        auto json = nlohmann::json::parse(identification.verdict_json, nullptr, false);
        auto verdict = verdict_from_json(json);
        if (verdict) verdicts.push_back(std::move(*verdict));
        test_.identified_scan = identification.window_end_scan;
        test_.submitted_scan = identification.window_end_scan;
    }
    test_.declarations.restore(std::move(verdicts));
    return {};
}

/// On the grid where it is now; what lies between it and the stored scans becomes missed scans.
void Daemon::go_on_with(const ResumedTest& resumed) {
    const TestRecord& record = resumed.test.record;
    prepare_flow(record.machine);
    resume_model(record);
    const std::int64_t last_scan = resumed.test.last_scan.value_or(-1);
    const std::int64_t missed =
        std::max<std::int64_t>(test_.grid.scan_at(clock_.monotonic_ns()) - last_scan - 1, 0);
    const std::int64_t missed_ns = missed * test_.grid.period_ns;
    if (missed_ns > longest_standstill_of_test_ns) {
        end_test(TestEvent::abort,
                 fmt::format("by the host's clock {} h have gone by since its last scan: too long to go on",
                             missed_ns / 3'600'000'000'000));
        return follow_grid({clock_.monotonic_ns(), test_.grid.period_ns}, 0);
    }
    follow_grid(test_.grid, last_scan + 1);
    event("resumed", fmt::format("test {} \"{}\" goes on: {} scans are stored, about {} were missed",
                                 test_.id, test_.name, last_scan + 1, missed));
    if (test_.state == TestState::declared) act_on_declaration();
}

/// From the next scan on.
void Daemon::set_input(const KnownInput& input) {
    const auto known = std::ranges::find(test_.inputs, input.name, &KnownInput::name);
    if (known == test_.inputs.end())
        test_.inputs.push_back(input);
    else
        known->value = input.value;
}

/// With the model that the test was begun with, whatever its file says by now.
void Daemon::resume_model(const TestRecord& record) {
    if (record.model_toml.empty()) return;
    auto model = load_model(record.model_toml, record.model_file);
    if (!model)
        return event("model_failed", "the stored model is not read any more: " + model.error().message);
    test_.model.emplace(
        TestModel{record.model_file, record.model_toml, std::make_shared<const Model>(std::move(*model))});
    const auto events = storage_.store().read().events(test_.id, 0, INT64_MAX);
    if (events) test_.model->restore(*events);
}

void Daemon::follow_grid(Grid grid, std::int64_t first_scan) {
    ++generation_;
    if (first_scan == 0) freeze_watch_.begin_grid();
    std::vector<std::size_t> channel_line;
    channel_line.reserve(options_.config.channels.size());
    for (const ChannelConfig& channel : options_.config.channels) {
        channel_line.push_back(options_.config.units[channel.unit].line);
    }
    assembler_.emplace(grid, generation_, first_scan, std::move(channel_line), options_.config.lines.size());
    for (const auto& reader : readers_) reader->follow(grid, generation_, first_scan);
    arm_close_timer();
}

}  // namespace thermbal
