#include "health_log.hpp"

#include <string_view>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace thermbal {
namespace {

using nlohmann::json;

std::string milliseconds(const json& figures) {
    return fmt::format("{:.2f} ms (median), {:.2f} (99 %), {:.2f} (most)", figures.at("p50").get<double>(),
                       figures.at("p99").get<double>(), figures.at("max").get<double>());
}

double mebibytes(const json& bytes) {
    return bytes.get<double>() / (1024.0 * 1024.0);
}

std::string daemon_line(const json& health) {
    const json& scans = health.at("scans");
    return fmt::format(
        "health: up {:.1f} h; scans {} ok, {} late, {} missed, {} lost, {} in memory; behind the grid {}; "
        "commit {}; WAL {:.1f} MiB, database {:.1f} MiB",
        health.at("up_s").get<double>() / 3600.0, scans.at("ok").dump(), scans.at("late").dump(),
        scans.at("missed").dump(), health.at("lost_scans").dump(), health.at("unstored_scans").dump(),
        milliseconds(health.at("lateness_ms")), milliseconds(health.at("commit_ms")),
        mebibytes(health.at("wal_bytes")), mebibytes(health.at("database_bytes")));
}

std::string round_trips(const json& histogram) {
    std::vector<std::string> classes;
    for (const json& bucket : histogram) {
        const std::string up_to = bucket.at("up_to_ms").is_null()
                                      ? "longer"
                                      : fmt::format("to {} ms", bucket.at("up_to_ms").get<double>());
        if (bucket.at("count") != 0)
            classes.push_back(fmt::format("{} {}", up_to, bucket.at("count").dump()));
    }
    return classes.empty() ? "none" : fmt::format("{}", fmt::join(classes, ", "));
}

std::string errors(const json& by_kind) {
    std::vector<std::string> happened;
    for (const auto& [kind, count] : by_kind.items()) {
        if (count != 0) happened.push_back(fmt::format("{} {}", kind, count.dump()));
    }
    return happened.empty() ? "none" : fmt::format("{}", fmt::join(happened, ", "));
}

std::string unit_line(const json& line, const json& unit) {
    return fmt::format(
        "health: line {}, unit {}: {}; round trips {}; errors {}; scans without an answer {}; "
        "reconnects of the line {}",
        line.at("line").get<std::string_view>(), unit.at("unit").get<std::string_view>(),
        unit.at("answering").get<bool>() ? "answering" : "silent", round_trips(unit.at("round_trips")),
        errors(unit.at("errors")), unit.at("failures").dump(), line.at("reconnects").dump());
}

}  // namespace

std::vector<std::string> health_log(const json& health) {
    std::vector<std::string> lines = {daemon_line(health)};
    for (const json& line : health.at("lines")) {
        for (const json& unit : line.at("units")) lines.push_back(unit_line(line, unit));
    }
    return lines;
}

}  // namespace thermbal
