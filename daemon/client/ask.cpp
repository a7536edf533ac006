#include "ask.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <utility>

#include <fmt/format.h>

#include "answers.hpp"
#include "columns.hpp"
#include "fields.hpp"
#include "files.hpp"
#include "output.hpp"
#include "samples.hpp"
#include "socket_client.hpp"

namespace thermbal {
namespace {

using nlohmann::json;

/// The daemon refused, or is not there: the command was well formed, so this is a failure at run time.
int report_run_time(Error error) {
    if (error.next == NextStep::refuse_input) error.next = NextStep::stop;
    return report_error(error);
}

template <typename Text>
int ask_and_print(const AskOptions& ask, const std::string& method, const json& params, Text text_of) {
    auto client = SocketClient::connect(ask.socket);
    if (!client) return report_run_time(client.error());
    const auto answer = client->ask(method, params);
    if (!answer) return report_run_time(answer.error());
    return ask.json ? print_json(*answer) : print_text(text_of(*answer));
}

json without_empty(json params) {
    for (auto it = params.begin(); it != params.end();) {
        it = it->is_string() && it->get_ref<const std::string&>().empty() ? params.erase(it) : std::next(it);
    }
    return params;
}

/// {"spindle_rpm": 5000.0} from "spindle_rpm=5000".
Result<json> inputs_in(const std::vector<std::string>& texts) {
    json inputs = json::object();
    for (const std::string& text : texts) {
        const std::size_t equals = text.find('=');
        const std::string digits = equals == std::string::npos ? "" : text.substr(equals + 1);
        double value = 0.0;
        const auto [end, code] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
        if (code != std::errc() || end != digits.data() + digits.size() || !std::isfinite(value)) {
            return fail(NextStep::refuse_input,
                        fmt::format("input: found \"{}\"; accepted: NAME=NUMBER, spindle_rpm=5000", text));
        }
        inputs[text.substr(0, equals)] = value;
    }
    return inputs;
}

std::string test_text(const json& answer) {
    const std::string model = text(answer, "model");
    return fmt::format("test {} is {}{}\n", fixed(number(answer, "test"), 0), text(answer, "state"),
                       model.empty() ? "" : fmt::format(", compared with model \"{}\"", printable(model)));
}

std::int64_t newest_id(const json& events, std::int64_t otherwise) {
    for (const json& event : list(events, "events")) {
        otherwise = std::max(otherwise, static_cast<std::int64_t>(number(event, "id").value_or(0.0)));
    }
    return otherwise;
}

int print_events(const json& events, bool as_json) {
    for (const json& event : list(events, "events")) {
        if (const int failed = as_json ? print_json_line(event)
                                       : print_text(event_time(event) + " " + event_message(event) + "\n");
            failed != 0) {
            return failed;
        }
    }
    return 0;
}

int follow_events(const AskOptions& ask, const EventsOptions& options) {
    auto client = SocketClient::connect(ask.socket);
    if (!client) return report_run_time(client.error());
    // Subscribed first: what happens between the two is then asked for again, not missed.
    if (const auto subscribed = client->subscribe({"event"}); !subscribed)
        return report_run_time(subscribed.error());
    std::int64_t after_id = options.after_id;
    std::int64_t limit = options.limit;
    for (;;) {
        // A notification lacks the time of day; the stored event has it.
        const auto events = client->ask("events", {{"after_id", after_id}, {"limit", limit}});
        if (!events) return report_run_time(events.error());
        if (const int failed = print_events(*events, ask.json); failed != 0) return failed;
        after_id = newest_id(*events, after_id);
        limit = 10'000;
        auto happened = client->next(std::chrono::hours(1));
        while (happened && !*happened) happened = client->next(std::chrono::hours(1));
        if (!happened) return report_run_time(happened.error());
    }
}

}  // namespace

int run_status(const AskOptions& ask) {
    return ask_and_print(ask, "status", json::object(), status_text);
}

int run_channels(const AskOptions& ask) {
    return ask_and_print(ask, "channels", json::object(), channels_text);
}

int run_predictions(const AskOptions& ask) {
    return ask_and_print(ask, "predictions", json::object(), predictions_text);
}

int run_health(const AskOptions& ask) {
    return ask_and_print(ask, "health", json::object(), health_text);
}

int run_start(const AskOptions& ask, const StartOptions& options) {
    json params = without_empty({{"name", options.name}, {"machine", options.machine}});
    const auto inputs = inputs_in(options.inputs);
    if (!inputs) return report_error(inputs.error());
    if (!inputs->empty()) params["inputs"] = *inputs;
    if (!options.model.empty()) {
        // Its text travels: the daemon may not read where the person may.
        const auto toml = read_file(options.model);
        if (!toml) return report_error(toml.error());
        params["model"] = *toml;
        params["model_file"] = options.model;
    }
    return ask_and_print(ask, "start_test", params, test_text);
}

int run_inputs(const AskOptions& ask, const std::vector<std::string>& texts) {
    const auto inputs = inputs_in(texts);
    if (!inputs) return report_error(inputs.error());
    return ask_and_print(ask, "set_inputs", {{"inputs", *inputs}},
                         [](const json&) { return std::string("noted\n"); });
}

int run_stop(const AskOptions& ask, const std::string& reason, bool abort) {
    json params = without_empty({{"reason", reason}});
    if (abort) params["abort"] = true;
    return ask_and_print(ask, "stop_test", params, test_text);
}

int run_annotate(const AskOptions& ask, const std::string& message, const std::string& channel) {
    return ask_and_print(ask, "annotate", without_empty({{"message", message}, {"channel", channel}}),
                         [](const json&) { return std::string("noted\n"); });
}

int run_samples(const AskOptions& ask, const SamplesOptions& options) {
    auto client = SocketClient::connect(ask.socket);
    if (!client) return report_run_time(client.error());
    json params = without_empty({{"channel", options.channel}});
    if (options.from_scan) params["from_scan"] = *options.from_scan;
    json samples;
    const auto asked =
        ask_samples([&](const json& page) { return client->ask("samples", page); }, params, options.limit,
                    [&](json answer) {
                        if (samples.is_null()) {
                            samples = std::move(answer);
                            return;
                        }
                        for (json& scan : answer["scans"]) samples["scans"].push_back(std::move(scan));
                    });
    if (!asked) return report_run_time(asked.error());
    return ask.json ? print_json(samples) : print_text(samples_text(samples));
}

int run_curve(const AskOptions& ask, const std::string& channel) {
    return ask_and_print(ask, "curve", without_empty({{"channel", channel}}), [](const json& curves) {
        const OutputStyle style = output_style();
        return curve_text(curves, style.columns, style.unicode);
    });
}

int run_events(const AskOptions& ask, const EventsOptions& options) {
    if (options.follow) return follow_events(ask, options);
    return ask_and_print(ask, "events", {{"after_id", options.after_id}, {"limit", options.limit}},
                         events_text);
}

}  // namespace thermbal
