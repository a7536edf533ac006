#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "daemon.hpp"
#include "report/verdict_json.hpp"

namespace thermbal {
namespace {

using nlohmann::json;

Result<json> bad_param(std::string_view what) {
    return fail(NextStep::refuse_input, std::string(what));
}

/// A string parameter; empty when it is not given.
Result<std::string> text_param(const json& params, const char* key) {
    const auto found = params.find(key);
    if (found == params.end() || found->is_null()) return std::string();
    if (!found->is_string()) return fail(NextStep::refuse_input, fmt::format("{}: expected a string", key));
    return found->get<std::string>();
}

/// The name of a configured channel; empty when it is not given.
Result<std::string> channel_param(const json& params, const std::vector<ChannelConfig>& channels) {
    auto name = text_param(params, "channel");
    if (name && !name->empty() && std::ranges::find(channels, *name, &ChannelConfig::name) == channels.end())
        return fail(NextStep::refuse_input, fmt::format("channel: there is no {}", *name));
    return name;
}

Result<std::int64_t> integer_param(const json& params, const char* key, std::int64_t otherwise) {
    const auto found = params.find(key);
    if (found == params.end() || found->is_null()) return otherwise;
    if (!found->is_number_integer())
        return fail(NextStep::refuse_input, fmt::format("{}: expected an integer", key));
    return found->get<std::int64_t>();
}

/// {"spindle_rpm": 5000.0, ...}; empty without the parameter.
Result<std::vector<KnownInput>> inputs_param(const json& params) {
    std::vector<KnownInput> inputs;
    const auto found = params.find("inputs");
    if (found == params.end() || found->is_null()) return inputs;
    if (!found->is_object())
        return fail(NextStep::refuse_input, "inputs: expected an object of numbers by name");
    for (const auto& [name, value] : found->items()) {
        if (!is_input_name(name))
            return fail(
                NextStep::refuse_input,
                fmt::format("inputs: found \"{}\"; accepted: a name of letters, digits and _ that is no "
                            "channel's",
                            name));
        if (!value.is_number())
            return fail(NextStep::refuse_input, fmt::format("inputs.{}: expected a number", name));
        inputs.push_back({name, value.get<double>()});
    }
    return inputs;
}

json inputs_json(const std::vector<KnownInput>& inputs) {
    json object = json::object();
    for (const KnownInput& input : inputs) object[input.name] = input.value;
    return object;
}

json sample_json(const Sample& sample) {
    return {{"value_C", sample.good() ? json(sample.value_C) : json(nullptr)},
            {"source_C", number_or_null(sample.source_C)},
            {"raw", sample.raw ? json(*sample.raw) : json(nullptr)},
            {"quality", to_string(sample.quality)}};
}

/// Least-squares slope of the newest good samples, in C per hour; NaN with fewer than two.
double rate_C_per_h(const std::vector<double>& values_C, double period_s, std::size_t samples) {
    const std::size_t first = values_C.size() > samples ? values_C.size() - samples : 0;
    double n = 0, st = 0, sv = 0, stt = 0, stv = 0;
    for (std::size_t i = first; i < values_C.size(); ++i) {
        if (!std::isfinite(values_C[i])) continue;
        const double t_h = static_cast<double>(i - first) * period_s / 3600.0;
        n += 1;
        st += t_h;
        sv += values_C[i];
        stt += t_h * t_h;
        stv += t_h * values_C[i];
    }
    const double determinant = n * stt - st * st;
    return determinant > 0 ? (n * stv - st * sv) / determinant : no_value;
}

/// Not a number stays not a number: an unknown equilibrium time is not "now".
double time_left_min(double equilibrium_time_min, double now_min) {
    return std::isfinite(equilibrium_time_min) ? std::max(0.0, equilibrium_time_min - now_min) : no_value;
}

/// So many samples are read and written in 30 ms, during which no other event is served.
std::int64_t most_scans(std::size_t channels) {
    constexpr std::size_t most_samples = 20'000;
    return static_cast<std::int64_t>(
        std::max<std::size_t>(most_samples / std::max<std::size_t>(channels, 1), 1));
}

/// Evenly thinned to at most `count` values, for a sparkline.
json thinned(const std::vector<double>& values, std::size_t count) {
    json list = json::array();
    const std::size_t wanted = std::min(count, values.size());
    for (std::size_t i = 0; i < wanted; ++i)
        list.push_back(number_or_null(values[(i + 1) * values.size() / wanted - 1]));
    return list;
}

}  // namespace

const ChannelVerdict* Daemon::verdict_of(const std::string& channel) const {
    const auto& standing = test_.declarations.standing();
    const auto found = std::ranges::find(standing, channel, &ChannelVerdict::channel);
    return found == standing.end() ? nullptr : &*found;
}

void Daemon::add_methods() {
    const auto reads = [this](const char* name, auto method) {
        server_.add_method(name, Access::reads, [this, method](const Request& request) -> Result<json> {
            if constexpr (std::is_invocable_v<decltype(method), Daemon&, const json&>) {
                return std::invoke(method, *this, request.params);
            } else {
                return std::invoke(method, *this);
            }
        });
    };
    reads("status", &Daemon::status_json);
    reads("channels", &Daemon::channels_json);
    reads("samples", &Daemon::samples_json);
    reads("curve", &Daemon::curve_json);
    reads("predictions", &Daemon::predictions_json);
    reads("events", &Daemon::events_json);
    reads("health", &Daemon::health_json);
    const auto changes = [this](const char* name, Result<json> (Daemon::*method)(const json&)) {
        server_.add_method(name, Access::changes, [this, method](const Request& request) {
            return std::invoke(method, *this, request.params);
        });
    };
    changes("start_test", &Daemon::on_start);
    changes("stop_test", &Daemon::on_stop);
    changes("annotate", &Daemon::on_annotate);
    changes("set_inputs", &Daemon::on_set_inputs);
    server_.add_topics({"scan", "predictions", "declaration", "comparison", "event", "status"});
}

Result<json> Daemon::status_json() const {
    const double now_s = static_cast<double>(clock_.monotonic_ns()) * 1e-9;
    json status = {{"state", to_string(test_.state)},
                   {"version", options_.version},
                   {"machine", options_.config.test.machine},
                   {"database", options_.config.store.path},
                   {"period_s", options_.config.test.period_s},
                   {"tolerance_C", options_.config.identification.tolerance_C},
                   {"keep_measuring", options_.config.test.keep_measuring},
                   {"test", nullptr},
                   {"last_scan_age_s", nullptr}};
    if (latest_) {
        const bool asked = latest_->status != ScanStatus::missed;
        status["last_scan_age_s"] =
            now_s - static_cast<double>(asked ? latest_->started_ns : latest_->due_ns) * 1e-9;
        status["good_channels"] = std::ranges::count_if(latest_->samples, &Sample::good);
    }
    if (test_.id > 0) {
        std::size_t declared = 0;
        for (const ChannelVerdict& verdict : test_.declarations.standing())
            declared += verdict.declared() ? 1U : 0U;
        status["test"] = {
            {"id", test_.id},
            {"name", test_.name},
            {"time_min", test_.grid.time_s(std::max<std::int64_t>(test_.last_scan, 0)) / 60.0},
            {"scans", test_.last_scan + 1},
            {"declared_channels", declared},
            {"waiting", test_.decision.waiting},
            {"reason", is_measuring(test_.state) ? test_.decision.reason : test_.end_reason},
            {"identified_at_min",
             test_.identified_scan ? json(test_.grid.time_s(*test_.identified_scan) / 60.0) : json(nullptr)},
            {"identification_age_s",
             test_.identified_scan
                 ? json(test_.grid.time_s(std::max(test_.last_scan, *test_.identified_scan)) -
                        test_.grid.time_s(*test_.identified_scan))
                 : json(nullptr)},
            {"identification_s", test_.identification_s},
            {"inputs", inputs_json(test_.inputs)},
            {"model", test_.model ? test_.model->to_json() : json(nullptr)}};
    }
    return status;
}

Result<json> Daemon::channels_json() const {
    constexpr std::size_t sparkline_points = 24;
    constexpr double rate_over_s = 600.0;
    json list = json::array();
    for (std::size_t i = 0; i < options_.config.channels.size(); ++i) {
        const ChannelConfig& channel = options_.config.channels[i];
        json entry = latest_ ? sample_json(latest_->samples[i]) : sample_json(Sample{});
        entry["channel"] = channel.name;
        entry["place"] = channel.place;
        entry["role"] = channel.role == ChannelConfig::Role::ambient ? "ambient" : "structure";
        entry["required"] = channel.required;
        if (test_.id > 0) {
            const std::vector<double>& values_C = test_.window.channels[i].values;
            const auto samples = static_cast<std::size_t>(rate_over_s / test_.window.period_s);
            entry["rise_C"] = number_or_null(newest_good_C_[i] - first_good(values_C));
            entry["rate_C_per_h"] = number_or_null(rate_C_per_h(values_C, test_.window.period_s, samples));
            entry["recent_C"] = thinned(values_C, sparkline_points);
        }
        if (const ChannelVerdict* verdict = verdict_of(channel.name)) {
            const double time_min = test_.grid.time_s(test_.last_scan) / 60.0;
            entry["state"] = to_string(verdict->state);
            entry["n"] = verdict->n;
            entry["window_rmse_C"] = number_or_null(verdict->window_rmse_C);
            entry["steady_state_C"] = number_or_null(verdict->steady_state_C);
            entry["steady_state_low_C"] = number_or_null(verdict->steady_state_low_C);
            entry["steady_state_high_C"] = number_or_null(verdict->steady_state_high_C);
            entry["equilibrium_time_min"] = number_or_null(verdict->equilibrium_time_min);
            entry["time_left_min"] = number_or_null(time_left_min(verdict->equilibrium_time_min, time_min));
            entry["reason"] = verdict->reason;
            entry["identification_age_s"] = number_or_null((time_min - verdict->window_end_min) * 60.0);
        }
        if (const ChannelComparison* compared = test_.model ? test_.model->channel(channel.name) : nullptr) {
            entry["simulated_C"] = number_or_null(compared->simulated_C);
            entry["residual_C"] = number_or_null(compared->residual_C());
            entry["disagrees"] = test_.model->disagrees(channel.name);
        }
        list.push_back(std::move(entry));
    }
    return json{
        {"time_min", test_.id > 0 ? json(test_.grid.time_s(std::max<std::int64_t>(test_.last_scan, 0)) / 60.0)
                                  : json(nullptr)},
        {"channels", std::move(list)}};
}

Result<json> Daemon::samples_json(const json& params) const {
    if (test_.id == 0) return bad_param("there is no test yet: start one first");
    const auto from_scan = integer_param(params, "from_scan", 0);
    if (!from_scan) return std::unexpected(from_scan.error());
    const auto limit = integer_param(params, "limit", 2000);
    if (!limit || *limit < 1 || *limit > 10'000) return bad_param("limit: expected 1 to 10000 scans");
    const auto& channels = options_.config.channels;
    const auto wanted = channel_param(params, channels);
    if (!wanted) return std::unexpected(wanted.error());
    const std::int64_t first = std::clamp<std::int64_t>(*from_scan, 0, std::int64_t{1} << 40);
    const auto scans = storage_.store().read().scans(
        test_.id, first, first + std::min(*limit, most_scans(channels.size())) - 1);
    if (!scans) return std::unexpected(scans.error());
    json rows = json::array();
    for (const ScanRecord& scan : *scans) {
        json samples = json::object();
        for (std::size_t i = 0; i < scan.samples.size() && i < channels.size(); ++i) {
            if (wanted->empty() || channels[i].name == *wanted)
                samples[channels[i].name] = sample_json(scan.samples[i]);
        }
        rows.push_back({{"scan", scan.scan},
                        {"time_s", scan.time_s},
                        {"wall_ns", scan.wall_ns},
                        {"status", to_string(scan.status)},
                        {"samples", std::move(samples)}});
    }
    return json{{"test", test_.id}, {"scans", std::move(rows)}};
}

Result<json> Daemon::curve_json(const json& params) const {
    const auto channel = channel_param(params, options_.config.channels);
    if (!channel) return std::unexpected(channel.error());
    json curves = json::array();
    for (const ChannelVerdict& verdict : test_.declarations.standing()) {
        if (!channel->empty() && verdict.channel != *channel) continue;
        const json whole = verdict_to_json(verdict);
        curves.push_back({{"channel", verdict.channel},
                          {"n", verdict.n},
                          {"window_end_min", whole["window_end_min"]},
                          {"rmse_by_n_C", whole["rmse_by_n_C"]}});
    }
    if (!channel->empty() && curves.empty()) {
        return bad_param(fmt::format("channel: no identification of {} yet", *channel));
    }
    return json{{"curves", std::move(curves)}};
}

Result<json> Daemon::predictions_json() const {
    json list = json::array();
    for (const ChannelVerdict& verdict : test_.declarations.standing())
        list.push_back(verdict_to_json(verdict));
    return json{{"test_stopped_at_min", is_measuring(test_.state) || test_.id == 0
                                            ? json(nullptr)
                                            : json(test_.grid.time_s(test_.last_scan) / 60.0)},
                {"stop", test_.decision.stop},
                {"reason", test_.decision.reason},
                {"channels", std::move(list)}};
}

Result<json> Daemon::events_json(const json& params) const {
    const auto after = integer_param(params, "after_id", 0);
    if (!after) return std::unexpected(after.error());
    const auto limit = integer_param(params, "limit", 200);
    if (!limit || *limit < 1 || *limit > 10'000) return bad_param("limit: expected 1 to 10000 events");
    const auto events = storage_.store().read().events(std::nullopt, *after, *limit);
    if (!events) return std::unexpected(events.error());
    json list = json::array();
    for (const EventRecord& event : *events) {
        list.push_back({{"id", event.id},
                        {"test", event.test_id ? json(*event.test_id) : json(nullptr)},
                        {"wall_ns", event.wall_ns},
                        {"time_s", event.time_s ? json(*event.time_s) : json(nullptr)},
                        {"kind", event.kind},
                        {"channel", event.channel ? json(*event.channel) : json(nullptr)},
                        {"message", event.message}});
    }
    return json{{"events", std::move(list)}};
}

Result<json> Daemon::on_start(const json& params) {
    if (is_measuring(test_.state)) {
        return bad_param(
            fmt::format("test {} \"{}\" is {}: stop it first", test_.id, test_.name, to_string(test_.state)));
    }
    const auto name = text_param(params, "name");
    const auto machine = text_param(params, "machine");
    if (!name || !machine) return std::unexpected(!name ? name.error() : machine.error());
    auto plan = plan_of(params);
    if (!plan) return std::unexpected(plan.error());
    if (!name->empty()) plan->name = *name;
    if (!machine->empty()) plan->machine = *machine;
    const auto id = start_test(std::move(*plan));
    if (!id) return std::unexpected(id.error());
    return json{{"test", *id},
                {"state", to_string(test_.state)},
                {"model", test_.model ? json(test_.model->model().model->name) : json(nullptr)}};
}

/// As configured, with the model and the inputs that a request names instead.
Result<Daemon::TestPlan> Daemon::plan_of(const json& params) const {
    const auto toml = text_param(params, "model");
    const auto file = text_param(params, "model_file");
    if (!toml || !file) return std::unexpected(!toml ? toml.error() : file.error());
    const auto inputs = inputs_param(params);
    if (!inputs) return std::unexpected(inputs.error());
    const TestConfig& test = options_.config.test;
    TestPlan plan{test.name, test.machine, *inputs, {}};
    for (const KnownInput& input : test.inputs) {
        if (std::ranges::find(plan.inputs, input.name, &KnownInput::name) == plan.inputs.end())
            plan.inputs.push_back(input);
    }
    if (toml->empty() && test.model.empty()) return plan;
    auto model = toml->empty()
                     ? read_test_model(test.model, options_.config, plan.inputs)
                     : parse_test_model(*toml, file->empty() ? "model" : *file, options_.config, plan.inputs);
    if (!model) return std::unexpected(model.error());
    plan.model = std::move(*model);
    return plan;
}

Result<json> Daemon::on_stop(const json& params) {
    if (!is_measuring(test_.state)) return bad_param("no test is running");
    const auto reason = text_param(params, "reason");
    if (!reason) return std::unexpected(reason.error());
    const auto abort = params.find("abort");
    if (abort != params.end() && !abort->is_boolean()) return bad_param("abort: expected true or false");
    const bool aborts = abort != params.end() && abort->get<bool>();
    end_test(aborts ? TestEvent::abort : TestEvent::stop, reason->empty() ? "by hand" : *reason);
    return json{{"test", test_.id}, {"state", to_string(test_.state)}};
}

Result<json> Daemon::on_set_inputs(const json& params) {
    if (!is_measuring(test_.state)) return bad_param("no test is running");
    const auto inputs = inputs_param(params);
    if (!inputs) return std::unexpected(inputs.error());
    if (inputs->empty()) return bad_param("inputs: expected at least one, {\"spindle_rpm\": 3000}");
    for (const KnownInput& input : *inputs) {
        set_input(input);
        event("input", fmt::format("{} is {:g} from now on", input.name, input.value));
    }
    return json{{"test", test_.id}, {"inputs", inputs_json(test_.inputs)}};
}

Result<json> Daemon::on_annotate(const json& params) {
    const auto message = text_param(params, "message");
    if (!message) return std::unexpected(message.error());
    if (message->empty()) return bad_param("message: expected a text");
    const auto channel = channel_param(params, options_.config.channels);
    if (!channel) return std::unexpected(channel.error());
    event("annotation", *message, channel->empty() ? std::nullopt : std::optional(*channel));
    return json{{"test", test_.id}};
}

}  // namespace thermbal
