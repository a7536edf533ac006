#include "model_watch.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "config/load.hpp"
#include "config/model_file.hpp"
#include "report/verdict_json.hpp"

namespace thermbal {
namespace {

using nlohmann::json;

constexpr double check_every_s = 300.0;
constexpr std::string_view disagrees_kind = "model_disagrees";
constexpr std::string_view agrees_kind = "model_agrees";
constexpr std::string_view failed_kind = "model_failed";

double check_turn(double time_s) {
    return std::floor(time_s / check_every_s + 1e-9);
}

std::string disagreement_in_words(const ChannelAgreement& now, const std::string& model, double time_s) {
    const bool goes_on = time_s - now.to_s < 2.0 * check_every_s;
    return fmt::format(
        "{}: measurement and model \"{}\" part by {:+.2f} C, {:.0f} times what noise and the model's own "
        "limits allow, {}; `thermbalctl diagnose` looks for what is missing",
        now.channel, model, now.peak_C, now.sigmas,
        goes_on ? fmt::format("since {:.0f} min", now.from_s / 60.0)
                : fmt::format("from {:.0f} to {:.0f} min", now.from_s / 60.0, now.to_s / 60.0));
}

}  // namespace

Result<TestModel> parse_test_model(std::string toml, std::string file, const Config& config,
                                   std::span<const KnownInput> inputs) {
    TestColumns columns;
    for (const ChannelConfig& channel : config.channels) columns.channels.insert(channel.name);
    for (const KnownInput& input : inputs) columns.inputs.insert(input.name);
    auto model = load_model(toml, file, columns);
    if (!model) return std::unexpected(model.error());
    return TestModel{std::move(file), std::move(toml), std::make_shared<const Model>(std::move(*model))};
}

Result<TestModel> read_test_model(const std::string& file, const Config& config,
                                  std::span<const KnownInput> inputs) {
    auto toml = read_text_file(file);
    if (!toml) return std::unexpected(toml.error());
    return parse_test_model(std::move(*toml), file, config, inputs);
}

void ModelWatch::restore(std::span<const EventRecord> events) {
    for (const EventRecord& event : events) {
        if (!event.channel) continue;
        std::erase_if(agreement_, [&](const auto& one) {
            return one.channel == *event.channel &&
                   (event.kind == disagrees_kind || event.kind == agrees_kind);
        });
        if (event.kind == disagrees_kind)
            agreement_.push_back({.channel = *event.channel, .disagrees = true});
    }
}

bool ModelWatch::check_is_due(double time_s) const {
    return check_turn(time_s) > check_turn(asked_to_check_s_);
}

ComparisonJob ModelWatch::job(std::uint64_t generation, std::int64_t scan, TestWindow window) {
    ComparisonJob job{generation, scan, model_.model, std::move(window), false, {}};
    const double time_s = job.window.end_s();
    job.check = check_is_due(time_s);
    if (!job.check) return job;
    asked_to_check_s_ = time_s;
    job.disagreeing = disagreeing();
    return job;
}

std::vector<ModelWatch::Change> ModelWatch::take(const ComparisonResult& result, double time_s) {
    std::vector<Change> changes;
    seconds_ = result.seconds;
    const Error* error = !result.channels                                     ? &result.channels.error()
                         : result.agreement && !result.agreement->has_value() ? &result.agreement->error()
                                                                              : nullptr;
    if (error != nullptr) {
        if (problem_.empty())
            changes.push_back(
                {std::string(failed_kind), {}, "no simulation to compare with: " + error->message});
        problem_ = error->message;
        return changes;
    }
    problem_.clear();
    channels_ = *result.channels;
    compared_s_ = time_s;
    if (result.agreement) changes = take_agreement(**result.agreement, time_s);
    return changes;
}

std::vector<ModelWatch::Change> ModelWatch::take_agreement(const std::vector<ChannelAgreement>& agreement,
                                                           double time_s) {
    std::vector<Change> changes;
    if (agreement.empty()) return changes;  // too short a test says nothing
    const std::string& name = model_.model->name;
    for (const ChannelAgreement& now : agreement) {
        if (now.disagrees == disagrees(now.channel)) continue;
        const auto message =
            now.disagrees ? disagreement_in_words(now, name, time_s)
                          : fmt::format("{}: measurement and model \"{}\" agree again", now.channel, name);
        changes.push_back({std::string(now.disagrees ? disagrees_kind : agrees_kind), now.channel, message});
    }
    agreement_ = agreement;
    checked_s_ = time_s;
    return changes;
}

const ChannelComparison* ModelWatch::channel(std::string_view name) const {
    const auto found = std::ranges::find(channels_, name, &ChannelComparison::channel);
    return found == channels_.end() ? nullptr : &*found;
}

bool ModelWatch::disagrees(std::string_view channel) const {
    const auto found = std::ranges::find(agreement_, channel, &ChannelAgreement::channel);
    return found != agreement_.end() && found->disagrees;
}

std::vector<std::string> ModelWatch::disagreeing() const {
    std::vector<std::string> names;
    for (const ChannelAgreement& one : agreement_) {
        if (one.disagrees) names.push_back(one.channel);
    }
    return names;
}

std::string_view ModelWatch::state() const {
    if (!problem_.empty()) return "failed";
    if (!disagreeing().empty()) return "disagrees";
    return checked_s_ ? "agrees" : "waiting";
}

json ModelWatch::to_json() const {
    const auto minutes = [](const std::optional<double>& time_s) {
        return time_s ? json(*time_s / 60.0) : json(nullptr);
    };
    json channels = json::array();
    for (const ChannelComparison& one : channels_) {
        json entry = {{"channel", one.channel},
                      {"measured_C", number_or_null(one.measured_C)},
                      {"simulated_C", number_or_null(one.simulated_C)},
                      {"residual_C", number_or_null(one.residual_C())},
                      {"disagrees", disagrees(one.channel)},
                      {"disagreement", nullptr}};
        const auto found = std::ranges::find(agreement_, one.channel, &ChannelAgreement::channel);
        if (found != agreement_.end() && found->disagrees && checked_s_) {
            entry["disagreement"] = {{"from_s", found->from_s},
                                     {"to_s", found->to_s},
                                     {"peak_C", found->peak_C},
                                     {"sigmas", found->sigmas}};
        }
        channels.push_back(std::move(entry));
    }
    return {{"name", model_.model->name},
            {"file", model_.file},
            {"state", state()},
            {"problem", problem_},
            {"compared_at_min", minutes(compared_s_)},
            {"checked_at_min", minutes(checked_s_)},
            {"comparison_s", seconds_},
            {"channels", std::move(channels)}};
}

}  // namespace thermbal
