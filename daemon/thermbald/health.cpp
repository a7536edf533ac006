#include <cstdint>
#include <fstream>
#include <string>
#include <utility>

#include <nlohmann/json.hpp>
#include <spdlog/spdlog.h>
#include <sys/resource.h>

#include "daemon.hpp"
#include "health_log.hpp"

namespace thermbal {
namespace {

using nlohmann::json;

json figures_json(const RecentFigures& figures) {
    return {{"count", figures.count()},
            {"p50", figures.quantile(0.5)},
            {"p99", figures.quantile(0.99)},
            {"p999", figures.quantile(0.999)},
            {"max", figures.maximum()}};
}

json histogram_json(const RoundTripHistogram& histogram) {
    json buckets = json::array();
    for (std::size_t i = 0; i < histogram.counts().size(); ++i) {
        const bool bounded = i < RoundTripHistogram::upper_ms.size();
        buckets.push_back({{"up_to_ms", bounded ? json(RoundTripHistogram::upper_ms[i]) : json(nullptr)},
                           {"count", histogram.counts()[i]}});
    }
    return buckets;
}

json errors_json(const LinkCounters& counters) {
    return {{"exceptions", counters.exceptions},
            {"timeouts", counters.timeouts},
            {"bad_frames", counters.bad_frames},
            {"stray_bytes", counters.stray_bytes},
            {"connect_failures", counters.connect_failures}};
}

json unit_json(const LineHealth::Unit& unit) {
    return {{"unit", unit.name},
            {"answering", unit.answering},
            {"round_trip_ms", unit.round_trip_ms},
            {"round_trips", histogram_json(unit.round_trips)},
            {"failures", unit.failures},
            {"errors", errors_json(unit.errors)},
            {"wrong_types", unit.wrong_types},
            {"last_error", unit.last_error}};
}

json line_json(const LineHealth& health) {
    json units = json::array();
    for (const LineHealth::Unit& unit : health.units) units.push_back(unit_json(unit));
    json line = errors_json(health.counters);
    line["line"] = health.name;
    line["requests"] = health.counters.requests;
    line["replies"] = health.counters.replies;
    line["connects"] = health.counters.connects;
    line["reconnects"] = health.counters.connects > 0 ? health.counters.connects - 1 : 0;
    line["units"] = std::move(units);
    return line;
}

/// Of this program alone, null where the kernel does not tell: what getrusage() tells goes on from who
/// started it.
json highest_memory_bytes() {
    std::ifstream status("/proc/self/status");
    for (std::string word; status >> word;) {
        std::int64_t kibibytes = 0;
        if (word == "VmHWM:" && status >> kibibytes) return kibibytes * 1024;
    }
    return nullptr;
}

}  // namespace

Result<json> Daemon::health_json() const {
    json lines = json::array();
    for (const auto& line : lines_) lines.push_back(line_json(line->health()));
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    const auto seconds = [](const timeval& time) {
        return static_cast<double>(time.tv_sec) + static_cast<double>(time.tv_usec) * 1e-6;
    };
    const SocketServer::Counters counters = server_.counters();
    return json{{"up_s", static_cast<double>(clock_.monotonic_ns() - started_ns_) * 1e-9},
                {"scans", {{"ok", scans_ok_}, {"late", scans_late_}, {"missed", scans_missed_}}},
                {"lateness_ms", figures_json(lateness_ms_)},
                {"commit_ms", figures_json(commit_ms_)},
                {"identification_s", figures_json(identification_s_)},
                {"comparison_s", figures_json(comparison_s_)},
                {"unstored_scans", storage_.unstored_scans()},
                {"unstored_scans_limit", storage_.limits().scans},
                {"unstored_writes", storage_.unstored_writes()},
                {"refused_writes", storage_.refused_writes()},
                {"lost_scans", storage_.lost_scans()},
                {"storage_problem", storage_.problem()},
                {"wal_bytes", storage_.store().wal_bytes()},
                {"database_bytes", storage_.store().database_bytes()},
                {"cpu_s", seconds(usage.ru_utime) + seconds(usage.ru_stime)},
                {"max_rss_bytes", highest_memory_bytes()},
                {"clients", counters.clients},
                {"lines", std::move(lines)}};
}

void Daemon::log_health() {
    health_logged_ns_ = clock_.monotonic_ns();
    const auto health = health_json();
    if (!health) return;
    for (const std::string& line : health_log(*health)) spdlog::info("{}", line);
}

void Daemon::log_health_hourly() {
    constexpr std::int64_t hour_ns = 3'600'000'000'000;
    if (clock_.monotonic_ns() - health_logged_ns_ >= hour_ns) log_health();
}

}  // namespace thermbal
