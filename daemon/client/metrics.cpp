#include "metrics.hpp"

#include <cmath>
#include <initializer_list>
#include <utility>

#include <fmt/format.h>

#include "fields.hpp"

namespace thermbal {
namespace {

using nlohmann::json;

/// Only \, " and line ends mean anything inside a label's value.
std::string escaped(std::string_view value) {
    std::string text;
    for (const char c : value) {
        if (c == '\\' || c == '"') text += '\\';
        text += c == '\n' ? std::string("\\n") : std::string(1, c);
    }
    return text;
}

using Labels = std::initializer_list<std::pair<std::string_view, std::string_view>>;

std::string label_text(const Labels& labels) {
    std::string text;
    for (const auto& [name, value] : labels)
        text += fmt::format("{}{}=\"{}\"", text.empty() ? "{" : ",", name, escaped(value));
    return text.empty() ? text : text + "}";
}

/// Collects metrics one after the other: a head, then its samples.
class Exposition {
  public:
    void begin(std::string_view name, std::string_view type, std::string_view help) {
        name_ = "thermbal_" + std::string(name);
        head_ = fmt::format("# HELP {} {}\n# TYPE {} {}\n", name_, help, name_, type);
    }
    void sample(std::optional<double> value, const Labels& labels = {}) {
        if (!value || !std::isfinite(*value)) return;
        // The head comes with the first sample: a metric without samples is not mentioned.
        text_ += std::exchange(head_, {}) + fmt::format("{}{} {}\n", name_, label_text(labels), *value);
    }
    void gauge(std::string_view name, std::string_view help, std::optional<double> value) {
        begin(name, "gauge", help);
        sample(value);
    }
    void counter(std::string_view name, std::string_view help, std::optional<double> value) {
        begin(name, "counter", help);
        sample(value);
    }
    std::string take() { return std::move(text_); }

  private:
    std::string name_;
    std::string head_;
    std::string text_;
};

double one_if(bool condition) {
    return condition ? 1.0 : 0.0;
}

std::optional<double> in_seconds(std::optional<double> value, double seconds) {
    return value ? std::optional(*value * seconds) : std::nullopt;
}

void add_test(Exposition& out, const json& status) {
    out.begin("info", "gauge", "The daemon's version and its machine.");
    out.sample(1.0, {{"version", text(status, "version")}, {"machine", text(status, "machine")}});
    out.begin("test_state", "gauge", "1 for the state that the test is in.");
    for (const std::string_view state : {"idle", "running", "declared", "stopped", "aborted"})
        out.sample(one_if(text(status, "state") == state), {{"state", state}});
    out.gauge("period_seconds", "The grid of the scans.", number(status, "period_s"));
    out.gauge("last_scan_age_seconds", "Time since the newest scan.", number(status, "last_scan_age_s"));
    out.gauge("good_channels", "Channels with a good reading at the newest scan.",
              number(status, "good_channels"));
    const json& test = object_in(status, "test");
    out.gauge("test_id", "The number of the test in the database.", number(test, "id"));
    out.gauge("test_elapsed_seconds", "Time since the test began.",
              in_seconds(number(test, "time_min"), 60.0));
    out.gauge("test_scans", "Scans of the test.", number(test, "scans"));
    out.gauge("test_declared_channels", "Channels whose steady state is declared.",
              number(test, "declared_channels"));
}

/// One gauge over all channels that have this figure.
void add_figure(Exposition& out, const json& channels, std::string_view name, std::string_view help,
                const char* key, double factor = 1.0) {
    out.begin(name, "gauge", help);
    for (const json& channel : list(channels, "channels"))
        out.sample(in_seconds(number(channel, key), factor), {{"channel", text(channel, "channel")}});
}

void add_channels(Exposition& out, const json& channels) {
    out.begin("channel_temperature_celsius", "gauge", "The newest reading, where it is good.");
    for (const json& channel : list(channels, "channels")) {
        if (text(channel, "quality") != "good") continue;
        out.sample(number(channel, "value_C"), {{"channel", text(channel, "channel")},
                                                {"place", text(channel, "place")},
                                                {"role", text(channel, "role")}});
    }
    out.begin("channel_quality", "gauge", "1, with the quality of the newest reading.");
    for (const json& channel : list(channels, "channels"))
        out.sample(1.0, {{"channel", text(channel, "channel")}, {"quality", text(channel, "quality")}});
    out.begin("channel_declared", "gauge", "1 where the steady state is declared.");
    for (const json& channel : list(channels, "channels"))
        out.sample(one_if(text(channel, "state") == "declared"), {{"channel", text(channel, "channel")}});
    add_figure(out, channels, "channel_steady_state_celsius",
               "Where the channel will settle, as far as is known.", "steady_state_C");
    add_figure(out, channels, "channel_steady_state_low_celsius", "Lower end of the central 90 % interval.",
               "steady_state_low_C");
    add_figure(out, channels, "channel_steady_state_high_celsius", "Upper end of the central 90 % interval.",
               "steady_state_high_C");
    add_figure(out, channels, "channel_equilibrium_time_seconds",
               "Time since the start at 95 % of the whole rise.", "equilibrium_time_min", 60.0);
}

void add_health(Exposition& out, const json& health) {
    out.gauge("up_seconds", "How long the daemon has been running.", number(health, "up_s"));
    out.begin("scans_total", "counter", "Scans since the daemon started, by how they went.");
    for (const char* status : {"ok", "late", "missed"})
        out.sample(number(object_in(health, "scans"), status), {{"status", status}});
    constexpr std::pair<const char*, double> figures[] = {
        {"lateness_ms", 1e-3}, {"commit_ms", 1e-3}, {"identification_s", 1.0}};
    for (const auto& [key, factor] : figures) {
        const std::string_view name(key);
        out.begin(std::string(name.substr(0, name.rfind('_'))) + "_seconds", "gauge",
                  "Of the recent ones: median, 99 %, 99.9 %, most.");
        for (const char* rank : {"p50", "p99", "p999", "max"})
            out.sample(in_seconds(number(object_in(health, key), rank), factor), {{"rank", rank}});
    }
    out.gauge("unstored_scans", "Scans in memory because the database does not take them.",
              number(health, "unstored_scans"));
    out.counter("lost_scans_total", "Scans that no memory was left for.", number(health, "lost_scans"));
    out.gauge("refused_writes", "Writes that the database contradicts.", number(health, "refused_writes"));
    out.gauge("wal_bytes", "Size of the write-ahead log.", number(health, "wal_bytes"));
    out.gauge("database_bytes", "Size of the database.", number(health, "database_bytes"));
    out.counter("cpu_seconds_total", "Processor time of the daemon.", number(health, "cpu_s"));
    out.gauge("resident_memory_max_bytes", "Most memory that the daemon has had.",
              number(health, "max_rss_bytes"));
    out.gauge("clients", "Connections on the daemon's socket.", number(health, "clients"));
}

void add_lines(Exposition& out, const json& health) {
    for (const char* key : {"requests", "replies", "exceptions", "timeouts", "bad_frames", "stray_bytes",
                            "connects", "connect_failures"}) {
        out.begin(fmt::format("line_{}_total", key), "counter",
                  "On a Modbus line, since the daemon started.");
        for (const json& line : list(health, "lines"))
            out.sample(number(line, key), {{"line", text(line, "line")}});
    }
    const auto each_unit = [&](const auto& take) {
        for (const json& line : list(health, "lines"))
            for (const json& unit : list(line, "units")) take(text(line, "line"), text(unit, "unit"), unit);
    };
    out.begin("unit_answering", "gauge", "1 while the module answers.");
    each_unit([&](const std::string& line, const std::string& name, const json& unit) {
        out.sample(one_if(flag(unit, "answering")), {{"line", line}, {"unit", name}});
    });
    out.begin("unit_round_trip_seconds", "gauge", "The newest request, from sent to answered.");
    each_unit([&](const std::string& line, const std::string& name, const json& unit) {
        out.sample(in_seconds(number(unit, "round_trip_ms"), 1e-3), {{"line", line}, {"unit", name}});
    });
    out.begin("unit_failures_total", "counter", "Scans without a trustworthy answer of the module.");
    each_unit([&](const std::string& line, const std::string& name, const json& unit) {
        out.sample(number(unit, "failures"), {{"line", line}, {"unit", name}});
    });
}

std::string up(double value) {
    Exposition out;
    out.gauge("up", "1 while the daemon answers on its socket.", value);
    return out.take();
}

}  // namespace

std::string prometheus_text(const DaemonAnswers& answers) {
    Exposition out;
    add_test(out, answers.status);
    add_channels(out, answers.channels);
    add_health(out, answers.health);
    add_lines(out, answers.health);
    return up(1.0) + out.take();
}

std::string prometheus_text_of_nobody() {
    return up(0.0);
}

}  // namespace thermbal
