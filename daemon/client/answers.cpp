#include "answers.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "columns.hpp"
#include "fields.hpp"
#include "plots.hpp"

namespace thermbal {

using nlohmann::json;

namespace {

std::string or_dash(std::string value) {
    return value.empty() ? "-" : std::move(value);
}

std::string whole(std::optional<double> value) {
    return fixed(value, 0);
}

std::string interval_C(const json& verdict) {
    const auto low = number(verdict, "steady_state_low_C");
    const auto high = number(verdict, "steady_state_high_C");
    return low && high ? fmt::format("{:.2f} .. {:.2f}", *low, *high) : std::string("-");
}

std::string joined(const json& names) {
    std::vector<std::string> texts;
    for (const json& name : names) {
        if (name.is_string()) texts.push_back(name.get<std::string>());
    }
    return fmt::format("{}", fmt::join(texts, ", "));
}

/// Local time, to the second.
std::string wall_time(const json& object) {
    const auto wall_ns = number(object, "wall_ns");
    if (!wall_ns) return "-";
    const auto seconds = static_cast<std::time_t>(*wall_ns * 1e-9);
    std::tm local{};
    std::array<char, 32> buffer{};
    if (localtime_r(&seconds, &local) == nullptr) return "-";
    return {buffer.data(), std::strftime(buffer.data(), buffer.size(), "%F %T", &local)};
}

/// Two columns, "test       12 "head"".
class Facts {
  public:
    void add(std::string_view name, const std::string& value) {
        if (!value.empty()) text_ += fmt::format("{:<16}{}\n", name, printable(value));
    }
    std::string str() const { return text_; }

  private:
    std::string text_;
};

}  // namespace

std::string state_name(const json& channel) {
    std::string state = text(channel, "state");
    if (state == "barely_warming") return "no rise";
    if (!state.empty()) return state;
    return text(channel, "role") == "ambient" ? "ambient" : "-";
}

std::string value_or_quality(const json& sample, bool is_short) {
    const std::string quality = text(sample, "quality");
    if (quality == "good") return fixed(number(sample, "value_C"), 2);
    constexpr std::array<std::pair<std::string_view, std::string_view>, 4> shorter = {
        {{"communication", "no link"},
         {"over_range", "over"},
         {"under_range", "under"},
         {"shorted", "shorted"}}};
    for (const auto& [name, short_name] : shorter) {
        if (is_short && quality == name) return std::string(short_name);
    }
    return quality.empty() ? "-" : quality;
}

namespace {

std::string inputs_text(const json& inputs) {
    std::vector<std::string> texts;
    for (const auto& [name, value] : inputs.items()) {
        if (value.is_number()) texts.push_back(fmt::format("{} = {:g}", name, value.get<double>()));
    }
    return fmt::format("{}", fmt::join(texts, ", "));
}

/// "\"spindle head\": agrees, largest residual T5 +0.12 C at 62.25 min".
std::string model_text(const json& model) {
    std::string line = fmt::format("\"{}\": {}", text(model, "name"), text(model, "state"));
    std::vector<std::string> apart;
    const json* largest = nullptr;
    for (const json& channel : list(model, "channels")) {
        if (flag(channel, "disagrees")) apart.push_back(text(channel, "channel"));
        const auto residual_C = number(channel, "residual_C");
        if (!residual_C) continue;
        if (largest == nullptr || std::abs(*residual_C) > std::abs(*number(*largest, "residual_C")))
            largest = &channel;
    }
    if (!apart.empty()) line += fmt::format(" at {}", fmt::join(apart, ", "));
    if (const std::string problem = text(model, "problem"); !problem.empty()) line += ": " + problem;
    if (largest != nullptr) {
        line += fmt::format(", largest residual {} {} C at {} min", text(*largest, "channel"),
                            with_sign(number(*largest, "residual_C"), 2),
                            fixed(number(model, "compared_at_min"), 2));
    }
    return line;
}

}  // namespace

std::string status_text(const json& status) {
    Facts facts;
    facts.add("state", or_dash(text(status, "state")));
    if (const json& test = object_in(status, "test"); !test.empty()) {
        facts.add("test", fmt::format("{} \"{}\"", whole(number(test, "id")), text(test, "name")));
        facts.add("time", fmt::format("{} min, {} scans", fixed(number(test, "time_min"), 2),
                                      whole(number(test, "scans"))));
        facts.add("declared", whole(number(test, "declared_channels")) + " channels");
        if (const std::string reason = text(test, "reason"); reason.starts_with("waiting for ")) {
            facts.add("waiting for", joined(list(test, "waiting")));
        } else {
            facts.add("reason", reason);
        }
        if (const auto at_min = number(test, "identified_at_min")) {
            facts.add("identified", fmt::format("at {:.2f} min, took {} s", *at_min,
                                                fixed(number(test, "identification_s"), 2)));
        }
        facts.add("inputs", inputs_text(object_in(test, "inputs")));
        if (const json& model = object_in(test, "model"); !model.empty())
            facts.add("model", model_text(model));
    } else {
        facts.add("test", "none yet: thermbalctl start");
    }
    facts.add("machine", text(status, "machine"));
    if (const auto age_s = number(status, "last_scan_age_s")) {
        facts.add("last scan", fmt::format("{:.1f} s ago, {} channels good, one every {:g} s", *age_s,
                                           whole(number(status, "good_channels")),
                                           number(status, "period_s").value_or(0.0)));
    } else {
        facts.add("last scan", "none yet");
    }
    facts.add("tolerance", fixed(number(status, "tolerance_C"), 2) + " C");
    facts.add("then", flag(status, "keep_measuring") ? "keeps measuring when all is declared"
                                                     : "stops when all is declared");
    facts.add("database", text(status, "database"));
    facts.add("version", text(status, "version"));
    return facts.str();
}

std::string channels_text(const json& channels) {
    TextTable table({{"channel"},
                     {"place"},
                     {"value C", true},
                     {"rise C", true},
                     {"C/h", true},
                     {"n", true},
                     {"RMSE C", true},
                     {"settles C", true},
                     {"90 % interval", true},
                     {"time left", true},
                     {"state"}});
    for (const json& channel : list(channels, "channels")) {
        const double n = number(channel, "n").value_or(0.0);
        // Rise and rate are of the readings that were good: not of now when the newest is not.
        const auto current = [&](const char* key) {
            return text(channel, "quality") == "good" ? number(channel, key) : std::nullopt;
        };
        table.add({text(channel, "channel"), text(channel, "place"), value_or_quality(channel, false),
                   with_sign(current("rise_C"), 2), with_sign(current("rate_C_per_h"), 1),
                   n > 0 ? whole(n) : "-", fixed(number(channel, "window_rmse_C"), 3),
                   fixed(number(channel, "steady_state_C"), 2), interval_C(channel),
                   minutes(number(channel, "time_left_min")),
                   state_name(channel) + (flag(channel, "required") ? "" : " (not required)")});
    }
    const auto time_min = number(channels, "time_min");
    return (time_min ? fmt::format("{:.2f} min\n", *time_min) : std::string("no test yet\n")) + table.str();
}

std::string samples_text(const json& samples) {
    const json& scans = list(samples, "scans");
    if (scans.empty()) return "no scans yet\n";
    std::vector<std::string> names;
    for (const auto& [name, sample] : object_in(scans.front(), "samples").items()) names.push_back(name);
    // T2 before T10: the object of JSON has no order of its own.
    std::ranges::sort(names, [](const std::string& a, const std::string& b) {
        return a.size() != b.size() ? a.size() < b.size() : a < b;
    });
    std::vector<TextTable::Column> columns = {{"scan", true}, {"min", true}, {"status"}};
    for (const std::string& name : names) columns.push_back({printable(name), true});
    TextTable table(columns);
    for (const json& scan : scans) {
        const auto time_s = number(scan, "time_s");
        std::vector<std::string> cells = {whole(number(scan, "scan")),
                                          time_s ? fixed(*time_s / 60.0, 2) : "-", text(scan, "status")};
        const json& values = object_in(scan, "samples");
        for (const std::string& name : names)
            cells.push_back(value_or_quality(object_in(values, name.c_str()), true));
        table.add(std::move(cells));
    }
    return table.str();
}

std::string curve_text(const json& curves, std::size_t width, bool unicode) {
    std::string plots;
    for (const json& curve : list(curves, "curves")) {
        if (!plots.empty()) plots += "\n";
        plots += curve_plot(curve, width, unicode);
    }
    return plots.empty() ? "no identification yet\n" : plots;
}

std::string predictions_text(const json& predictions) {
    TextTable table({{"channel"},
                     {"state"},
                     {"declared at", true},
                     {"n", true},
                     {"RMSE C", true},
                     {"settles C", true},
                     {"90 % interval", true},
                     {"95 % at", true},
                     {"SVR alone C", true},
                     {"reason"}});
    for (const json& verdict : list(predictions, "channels")) {
        const double n = number(verdict, "n").value_or(0.0);
        const auto declared_min = number(verdict, "declared_at_min");
        table.add({text(verdict, "channel"), state_name(verdict),
                   declared_min ? fmt::format("{:.2f} min", *declared_min) : "-", n > 0 ? whole(n) : "-",
                   fixed(number(verdict, "window_rmse_C"), 3), fixed(number(verdict, "steady_state_C"), 2),
                   interval_C(verdict), minutes(number(verdict, "equilibrium_time_min")),
                   fixed(number(object_in(verdict, "svr"), "steady_state_C"), 2), text(verdict, "reason")});
    }
    std::string verdict = printable(text(predictions, "reason"));
    if (const auto stopped_min = number(predictions, "test_stopped_at_min")) {
        verdict = fmt::format("test stopped at {:.2f} min: {}", *stopped_min, verdict);
    }
    if (list(predictions, "channels").empty()) return "no identification yet\n";
    return table.str() + (verdict.empty() ? "" : verdict + "\n");
}

std::string events_text(const json& events) {
    TextTable table(
        {{"id", true}, {"time"}, {"test", true}, {"at", true}, {"event"}, {"channel"}, {"message"}});
    for (const json& event : list(events, "events")) {
        table.add({whole(number(event, "id")), wall_time(event), whole(number(event, "test")),
                   number(event, "time_s") ? event_time(event) : "-", text(event, "kind"),
                   or_dash(text(event, "channel")), text(event, "message")});
    }
    return list(events, "events").empty() ? "no events\n" : table.str();
}

std::string event_time(const json& event) {
    const auto time_s = number(event, "time_s");
    return time_s ? fmt::format("{:.2f} min", *time_s / 60.0) : wall_time(event);
}

std::string event_message(const json& event) {
    const std::string channel = text(event, "channel");
    const std::string message = text(event, "message");
    const bool names_channel = channel.empty() || message.starts_with(channel);
    return printable(fmt::format("{}{}{}: {}", text(event, "kind"), names_channel ? "" : " ",
                                 names_channel ? "" : channel, message));
}

namespace {

/// "  u0: round trips 12 up to 5 ms, 3 up to 10 ms; errors: 2 timeouts": what has happened, nothing else.
std::string unit_details(const json& unit) {
    std::string trips;
    for (const json& bucket : list(unit, "round_trips")) {
        const double count = number(bucket, "count").value_or(0.0);
        if (count < 1.0) continue;
        const auto bound = number(bucket, "up_to_ms");
        trips += fmt::format("{}{} {}", trips.empty() ? "" : ", ", whole(count),
                             bound ? fmt::format("up to {} ms", whole(bound)) : std::string("longer"));
    }
    std::string errors;
    for (const auto& [kind, count] : object_in(unit, "errors").items()) {
        if (!count.is_number() || count.get<double>() < 1.0) continue;
        std::string name = kind;
        std::ranges::replace(name, '_', ' ');
        errors +=
            fmt::format("{}{} {}", errors.empty() ? "" : ", ", whole(count.get<double>()), printable(name));
    }
    std::string line;
    if (!trips.empty()) line += " round trips: " + trips + ";";
    if (!errors.empty()) line += " errors: " + errors + ";";
    if (const std::string wrong = text(unit, "wrong_types"); !wrong.empty())
        line += " TYPE CODES: " + wrong + ";";
    if (line.empty()) return {};
    line.pop_back();
    return fmt::format("  {}:{}\n", text(unit, "unit"), line);
}

}  // namespace

std::string health_text(const json& health) {
    const json& scans = object_in(health, "scans");
    Facts facts;
    facts.add("up", minutes(number(health, "up_s").value_or(0.0) / 60.0));
    facts.add("scans", fmt::format("{} ok, {} late, {} missed", whole(number(scans, "ok")),
                                   whole(number(scans, "late")), whole(number(scans, "missed"))));
    const auto figures = [&](const char* name, const char* key, const char* unit, int digits) {
        const json& of = object_in(health, key);
        if (number(of, "count").value_or(0.0) < 1.0) return;
        facts.add(name, fmt::format("{} {} median, {} {} in 99 %, {} {} most",
                                    fixed(number(of, "p50"), digits), unit, fixed(number(of, "p99"), digits),
                                    unit, fixed(number(of, "max"), digits), unit));
    };
    figures("scan lateness", "lateness_ms", "ms", 2);
    figures("commit", "commit_ms", "ms", 2);
    figures("identification", "identification_s", "s", 2);
    facts.add("database", fmt::format("{}, log {}", bytes(number(health, "database_bytes")),
                                      bytes(number(health, "wal_bytes"))));
    if (number(health, "unstored_scans").value_or(0.0) > 0) {
        facts.add(
            "NOT STORED",
            fmt::format("{} of at most {} scans wait in memory: {}", whole(number(health, "unstored_scans")),
                        whole(number(health, "unstored_scans_limit")), text(health, "storage_problem")));
    }
    if (number(health, "lost_scans").value_or(0.0) > 0)
        facts.add("LOST", whole(number(health, "lost_scans")) + " scans");
    if (number(health, "refused_writes").value_or(0.0) > 0)
        facts.add("REFUSED",
                  whole(number(health, "refused_writes")) + " writes that the database contradicts");
    facts.add("processor", fixed(number(health, "cpu_s"), 1) + " s");
    facts.add("memory", bytes(number(health, "max_rss_bytes")) + " at most");
    facts.add("clients", whole(number(health, "clients")));
    std::string whole_text = facts.str();
    for (const json& line : list(health, "lines")) {
        whole_text += fmt::format(
            "\nline {}: {} requests, {} replies, {} exceptions, {} timeouts, {} bad frames, {} stray "
            "bytes, {} connects, {} failed\n",
            printable(text(line, "line")), whole(number(line, "requests")), whole(number(line, "replies")),
            whole(number(line, "exceptions")), whole(number(line, "timeouts")),
            whole(number(line, "bad_frames")), whole(number(line, "stray_bytes")),
            whole(number(line, "connects")), whole(number(line, "connect_failures")));
        TextTable units(
            {{"  unit"}, {"answering"}, {"round trip", true}, {"failures", true}, {"last error"}});
        for (const json& unit : list(line, "units")) {
            const bool had_trouble = !flag(unit, "answering") || number(unit, "failures").value_or(0.0) > 0;
            units.add({fmt::format("  {}", text(unit, "unit")), flag(unit, "answering") ? "yes" : "NO",
                       fixed(number(unit, "round_trip_ms"), 1) + " ms", whole(number(unit, "failures")),
                       had_trouble ? or_dash(text(unit, "last_error")) : "-"});
        }
        whole_text += units.str();
        for (const json& unit : list(line, "units")) whole_text += unit_details(unit);
    }
    return whole_text;
}

}  // namespace thermbal
