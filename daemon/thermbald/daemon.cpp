#include "daemon.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "compute/declaration_record.hpp"
#include "report/verdict_json.hpp"
#include "service/notify.hpp"

namespace thermbal {

// The live flow:
//   module -> scan -> store -> window -> (filter -> SVR sweep -> criterion, shared time constants ->
//   interval: core's LiveFlow, on the identifier's thread) -> declaration -> stop rule -> stop

namespace {

/// The column of that name, made where there is none yet.
Column& column_of(std::vector<Column>& columns, const std::string& name) {
    const auto found = std::ranges::find(columns, name, &Column::name);
    return found != columns.end() ? *found : columns.emplace_back(Column{name, {}});
}

/// What a steady state holds for: the room may move on.
std::string in_its_room(const ChannelVerdict& verdict) {
    return std::isfinite(verdict.room_C) ? fmt::format(" in a room of {:.2f} C", verdict.room_C) : "";
}

}  // namespace

void Daemon::take_scan(Scan& scan) {
    watch_modules(scan);
    watch_time(scan);
    latest_ = scan;
    if (is_measuring(test_.state)) {
        store_scan(scan);
        grow_window(scan);
        raise_alarm(scan);
        if (is_measuring(test_.state) && identification_is_due(scan.scan)) {
            test_.identifying = true;
            test_.submitted_scan = scan.scan;
            identifier_->submit({generation_, scan.scan,
                                 coarsened(test_.window, test_.flow->longest_window_scans),
                                 test_.declarations.declared_channels(), test_.flow});
        }
        if (is_measuring(test_.state)) compare_with_model(scan.scan);
        if (is_measuring(test_.state) && over_time(scan)) {
            // What is declared is a result, however long somebody wanted to go on measuring.
            const TestEvent how = test_.state == TestState::declared ? TestEvent::stop : TestEvent::abort;
            stop_machine_and_end(how, fmt::format("longer than test.max_duration_min = {}",
                                                  *options_.config.test.max_duration_min));
        }
    }
    log_health_hourly();
    if (server_.counters().subscribers > 0) server_.publish("scan", channels_json().value_or(nullptr));
    settle(scan.scan);
}

void Daemon::take_identification(IdentificationResult result) {
    if (result.generation != generation_ || !is_measuring(test_.state)) return;
    test_.identifying = false;
    if (result.window_end_scan <= test_.revised_until_scan) return settle(test_.last_scan);
    identification_s_.add(result.seconds);
    test_.identification_s = result.seconds;
    if (!result.verdict) {
        spdlog::debug("identification at scan {}: {}", result.window_end_scan,
                      result.verdict.error().message);
    } else {
        test_.identified_scan = result.window_end_scan;
        if (test_.archive_dropped.empty() && !result.verdict->archive_dropped.empty()) {
            test_.archive_dropped = result.verdict->archive_dropped;
            event("archive_dropped", test_.archive_dropped);
        }
        test_.spectrum = std::move(result.verdict->spectrum);
        test_.spectrum_window_min = result.verdict->window_end_min;
        const auto changes =
            test_.declarations.update(result.verdict->channels, result.verdict->last_change_min,
                                      test_.state == TestState::running ? Renewals::wanted : Renewals::over);
        record_changes(changes, result.window_end_scan);
        server_.publish("predictions", predictions_json().value_or(nullptr));
        decide();
    }
    settle(test_.last_scan);
}

void Daemon::decide() {
    std::vector<bool> required;
    for (const ChannelVerdict& verdict : test_.declarations.standing()) {
        const auto channel =
            std::ranges::find(options_.config.channels, verdict.channel, &ChannelConfig::name);
        required.push_back(channel != options_.config.channels.end() && channel->required);
    }
    const StopDecision before = std::exchange(
        test_.decision, decide_stop(test_.declarations.standing(), required, test_.spectrum_window_min));
    if (test_.state != TestState::running) return;
    if (test_.decision.held && before.reason != test_.decision.reason) event("held", test_.decision.reason);
    if (!test_.decision.stop) return;

    test_.state = TestState::declared;
    storage_.set_state(test_.id, TestState::running, TestState::declared, now(), test_.decision.reason);
    event("all_declared", test_.decision.reason);
    act_on_declaration();
}

void Daemon::act_on_declaration() {
    if (options_.config.test.keep_measuring) {
        event("keep_measuring", "the test goes on as configured, so that the prediction can be checked");
    } else {
        stop_machine_and_end(TestEvent::stop, test_.decision.reason);
    }
}

void Daemon::end_test(TestEvent how, const std::string& reason) {
    const auto state = next_state(test_.state, how);
    if (!state) return;
    identifier_->cancel();
    comparer_->cancel();
    test_.identifying = test_.comparing = false;
    storage_.set_state(test_.id, test_.state, *state, now(), reason);
    test_.state = *state;
    test_.end_reason = reason;
    archive_test();
    event(to_string(*state), reason);
    settle(test_.last_scan);
    server_.publish("status", status_json().value_or(nullptr));
    notify_status(fmt::format("test {}: {}", to_string(*state), reason));
}

void Daemon::grow_window(const Scan& scan) {
    TestWindow& window = test_.window;
    const auto rows = static_cast<std::size_t>(scan.scan + 1);
    for (std::size_t channel = 0; channel < window.channels.size(); ++channel) {
        window.channels[channel].values.resize(rows, no_value);
        const Sample& sample = scan.samples[channel];
        if (!sample.good()) continue;
        window.channels[channel].values.back() = sample.value_C;
        newest_good_C_[channel] = sample.value_C;
    }
    for (const KnownInput& input : test_.inputs) {
        std::vector<double>& values = column_of(window.inputs, input.name).values;
        const double held = values.empty() ? no_value : values.back();
        values.resize(rows, held);
        values.back() = input.value;
    }
    window.scans = rows;
    test_.last_scan = scan.scan;
}

/// On multiples of every_s of the test's time, as replay does it, so that both see the same windows; while
/// the identifier is at work, the first scan after it.
bool Daemon::identification_is_due(std::int64_t scan) const {
    const double scans_between = options_.config.identification.every_s / options_.config.test.period_s;
    const auto turn = [&](std::int64_t at) {
        return std::floor(static_cast<double>(at) / scans_between + 1e-9);
    };
    return turn(scan) > turn(test_.submitted_scan) && !test_.identifying;
}

void Daemon::record_changes(const std::vector<DeclarationChange>& changes, std::int64_t window_end_scan) {
    std::vector<IdentificationRecord> records;
    for (const ChannelVerdict& verdict : test_.declarations.standing()) {
        records.push_back(
            {verdict.channel, window_end_scan, clock_.wall_ns(), verdict_to_json(verdict).dump()});
    }
    write([id = test_.id,
           records = std::move(records)](Store& store) { return store.record_identifications(id, records); },
          "identifications");
    for (const DeclarationChange& change : changes) {
        if (change.kind != DeclarationChange::Kind::declared) {
            write([id = test_.id, change](Store& store) {
                return store.withdraw_declaration(id, change.channel, change.reason);
            });
        }
        if (change.kind == DeclarationChange::Kind::withdrawn) {
            event("withdrawn",
                  fmt::format("{}: the declaration is withdrawn: {}", change.channel, change.reason),
                  change.channel);
            continue;
        }
        const ChannelVerdict& verdict = *verdict_of(change.channel);
        const nlohmann::json json = verdict_to_json(verdict);
        auto record = declaration_record(verdict, window_end_scan, json.dump(), options_.version);
        write([id = test_.id, record = std::move(record)](Store& store) {
            return store.record_declaration(id, record);
        });
        event(to_string(change.kind),
              fmt::format("{} settles at {:.2f} C ({:.2f} to {:.2f} C){}, 95 % of the rise at {:.0f} min{}",
                          verdict.channel, verdict.steady_state_C, verdict.steady_state_low_C,
                          verdict.steady_state_high_C, in_its_room(verdict), verdict.equilibrium_time_min,
                          change.kind == DeclarationChange::Kind::renewed ? "; " + change.reason : ""),
              verdict.channel);
        server_.publish("declaration", json);
    }
}

/// A test without a person beside it must not do damage: the machine is stopped as at the end of any test.
void Daemon::raise_alarm(const Scan& scan) {
    const auto alarm = alarm_watch_->take(test_.grid.time_s(scan.scan), scan.samples);
    if (!alarm) return;
    const std::string& channel = options_.config.channels[alarm->channel].name;
    const std::string reason = fmt::format("alarm: {} {}", channel, alarm->reason);
    if (!test_.stopping) event("alarm", reason, channel);
    stop_machine_and_end(TestEvent::abort, reason);
}

bool Daemon::over_time(const Scan& scan) const {
    const auto& limit_min = options_.config.test.max_duration_min;
    return limit_min && test_.grid.time_s(scan.scan) > *limit_min * 60.0;
}

}  // namespace thermbal
