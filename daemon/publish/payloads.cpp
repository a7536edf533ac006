#include "publish/payloads.hpp"

#include <algorithm>
#include <cmath>
#include <ctime>

#include <fmt/format.h>

namespace thermbal {
namespace {

using nlohmann::json;

json number_or_null(double value) {
    return std::isfinite(value) ? json(value) : json(nullptr);
}

template <typename T>
json value_or_null(const std::optional<T>& value) {
    return value ? json(*value) : json(nullptr);
}

json sample_json(const Sample& sample) {
    return {{"value_C", sample.good() ? json(sample.value_C) : json(nullptr)},
            {"quality", to_string(sample.quality)},
            {"raw", value_or_null(sample.raw)}};
}

json samples_json(const StoredTest& test, const ScanRecord& scan) {
    json samples = json::object();
    const auto& channels = test.record.channels;
    for (std::size_t i = 0; i < channels.size(); ++i)
        samples[channels[i].name] = sample_json(i < scan.samples.size() ? scan.samples[i] : Sample{});
    return samples;
}

json steady_state_json(const DeclarationRecord& declaration) {
    return {{"declared_at_min", number_or_null(declaration.declared_at_min)},
            {"steady_state_C", number_or_null(declaration.steady_state_C)},
            {"steady_state_low_C", number_or_null(declaration.steady_state_low_C)},
            {"steady_state_high_C", number_or_null(declaration.steady_state_high_C)},
            {"equilibrium_time_min", number_or_null(declaration.equilibrium_time_min)},
            {"n", declaration.n}};
}

json standing_declaration(const std::vector<DeclarationRecord>& declarations, const std::string& channel) {
    const auto stands = [&](const DeclarationRecord& declaration) {
        return declaration.channel == channel && declaration.withdrawn.empty();
    };
    const auto found = std::ranges::find_if(declarations, stands);
    return found == declarations.end() ? json(nullptr) : steady_state_json(*found);
}

}  // namespace

std::string utc_time(std::int64_t wall_ns) {
    constexpr std::int64_t second_ns = 1'000'000'000;
    // Times before 1970 count down to their second, so that the milliseconds go up.
    const std::int64_t below = ((wall_ns % second_ns) + second_ns) % second_ns;
    const auto seconds = static_cast<std::time_t>((wall_ns - below) / second_ns);
    std::tm utc{};
    if (gmtime_r(&seconds, &utc) == nullptr) return "";
    return fmt::format("{:04}-{:02}-{:02}T{:02}:{:02}:{:02}.{:03}Z", utc.tm_year + 1900, utc.tm_mon + 1,
                       utc.tm_mday, utc.tm_hour, utc.tm_min, utc.tm_sec, below / 1'000'000);
}

json samples_payload(const std::string& database, const StoredTest& test, const ScanRecord& scan,
                     bool revised) {
    json inputs = json::object();
    for (const InputValue& input : scan.inputs) inputs[input.name] = number_or_null(input.value);
    return {{"database", database},
            {"test", test.id},
            {"scan", scan.scan},
            {"at", utc_time(scan.wall_ns)},
            {"time_s", number_or_null(scan.time_s)},
            {"status", to_string(scan.status)},
            {"revised", revised},
            {"samples", samples_json(test, scan)},
            {"inputs", std::move(inputs)}};
}

json declaration_payload(const std::string& database, const StoredTest& test,
                         const DeclarationRecord& declaration) {
    json payload = steady_state_json(declaration);
    payload["database"] = database;
    payload["test"] = test.id;
    payload["test_name"] = test.record.name;
    payload["channel"] = declaration.channel;
    payload["withdrawn"] = declaration.withdrawn.empty() ? json(nullptr) : json(declaration.withdrawn);
    return payload;
}

json event_payload(const std::string& database, const EventRecord& event) {
    return {{"database", database},
            {"id", event.id},
            {"test", value_or_null(event.test_id)},
            {"at", utc_time(event.wall_ns)},
            {"time_s", value_or_null(event.time_s)},
            {"kind", event.kind},
            {"channel", value_or_null(event.channel)},
            {"message", event.message}};
}

json test_payload(const std::string& database, const StoredTest& test,
                  const std::vector<DeclarationRecord>& declarations) {
    json channels = json::array();
    for (const ChannelRecord& channel : test.record.channels) {
        channels.push_back({{"channel", channel.name},
                            {"role", channel.role},
                            {"place", channel.place},
                            {"required", channel.required},
                            {"declaration", standing_declaration(declarations, channel.name)}});
    }
    return {{"database", database},
            {"test", test.id},
            {"name", test.record.name},
            {"machine", test.record.machine},
            {"state", to_string(test.state)},
            {"reason", test.stop_reason},
            {"period_s", test.record.period_s},
            {"started_at", utc_time(test.record.started.wall_ns)},
            {"ended_at", test.ended ? json(utc_time(test.ended->wall_ns)) : json(nullptr)},
            {"channels", std::move(channels)}};
}

}  // namespace thermbal
