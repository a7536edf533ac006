#include <algorithm>
#include <cmath>
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

std::int64_t period_ns_of(double period_s) {
    return std::llround(period_s * 1e9);
}

std::string describe_source(const Config& config, const ChannelConfig& channel) {
    const UnitConfig& unit = config.units[channel.unit];
    return fmt::format("line {}, unit {} (id {}), input {}", config.lines[unit.line].link.name, unit.name,
                       unit.unit_id, channel.input);
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

/// What this test has taught about the machine, for the next one. A short test taught too little.
void Daemon::archive_test() {
    constexpr double least_window_min = 60.0;
    if (!test_.spectrum || test_.spectrum_window_min < least_window_min) return;
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

    begin_window(record.period_s);
    // Where each stored channel is now; those that are no more have no place.
    std::vector<std::size_t> position;
    const auto& channels = options_.config.channels;
    for (const ChannelRecord& channel : record.channels) {
        const auto found = std::ranges::find(channels, channel.name, &ChannelConfig::name);
        position.push_back(static_cast<std::size_t>(found - channels.begin()));
    }
    const auto read = storage_.store().read().each_scan(stored.id, 0, INT64_MAX, [&](ScanRecord& scan) {
        Scan again{.scan = scan.scan, .samples = std::vector<Sample>(channels.size())};
        for (std::size_t i = 0; i < std::min(scan.samples.size(), position.size()); ++i) {
            if (position[i] < channels.size()) again.samples[position[i]] = scan.samples[i];
        }
        for (const InputValue& input : scan.inputs) set_input({input.name, input.value});
        grow_window(again);
        // Only so that a limit goes on where it was: what was an alarm has ended the test then.
        alarm_watch_->take(test_.grid.time_s(again.scan), again.samples);
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
    follow_grid(test_.grid, last_scan + 1);
    const std::int64_t missed = test_.grid.scan_at(clock_.monotonic_ns()) - last_scan - 1;
    event("resumed", fmt::format("test {} \"{}\" goes on: {} scans are stored, about {} were missed",
                                 test_.id, test_.name, last_scan + 1, std::max<std::int64_t>(missed, 0)));
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
    freeze_watch_.begin_grid();
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
