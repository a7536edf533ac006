/// Writes the database of a finished test for the report's tests: two exponentials a channel above a room of
/// 18 C with noise, rounded to 0.1 C, some samples missing or broken; declared where the shared time
/// constants see a window of a third of the test. `write_database OUT.db SCANS CHANNELS [hostile]`
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <string>

#include "compute/declaration_record.hpp"
#include "declaration/course.hpp"
#include "declaration/live_flow.hpp"
#include "report/verdict_json.hpp"
#include "store/store.hpp"

namespace thermbal {
namespace {

constexpr double period_s = 15.0;
constexpr std::int64_t period_ns = 15'000'000'000;
constexpr Moment begun{1'700'000'000'000'000'000, 5'000'000'000};

/// What a person, or somebody else, can put into a name.
constexpr const char* hostile_texts[] = {"</script><script>window.attacked=1</script>",
                                         "<img src=x onerror=window.attacked=1>",
                                         "\"'><b onmouseover=window.attacked=1>",
                                         "\xE2\x80\xAE"
                                         "desrever &amp; <!--",
                                         "a place whose name goes on and on, as names do that somebody "
                                         "pasted from a drawing list without looking at it"};

std::string place_of(std::size_t channel, bool hostile) {
    static constexpr const char* places[] = {
        "air at the machine", "front bearing",    "rear bearing",     "sleeve front",
        "headstock front",    "sleeve rear",      "headstock middle", "headstock rear",
        "headstock top",      "headstock bottom", "motor housing",    "motor flange",
        "nose cover",         "guideway",         "column upper",     "column middle"};
    return hostile ? hostile_texts[channel % std::size(hostile_texts)] : places[channel % std::size(places)];
}

std::string name_of(std::size_t channel, bool hostile) {
    std::string name = "T" + std::to_string(channel + 1);
    return hostile && channel == 2 ? name + hostile_texts[0] : name;
}

TestRecord record_of(std::size_t channels, bool hostile) {
    TestRecord record;
    record.name = hostile ? hostile_texts[0] : "5000 idle";
    record.machine = hostile ? hostile_texts[1] : "vertical machining centre";
    record.config_toml = std::string("[identification]\ntolerance_C = 0.25\n") +
                         (hostile ? "# </pre><script>window.attacked=1</script>\n" : "");
    record.version = "0.1.0";
    record.period_s = period_s;
    record.started = begun;
    record.boot_id = "4a0c";
    for (std::size_t i = 0; i < channels; ++i) {
        record.channels.push_back({name_of(i, hostile), i == 0 ? "ambient" : "structure",
                                   place_of(i, hostile), i > 0, "unit 1, input " + std::to_string(i + 1),
                                   ""});
    }
    return record;
}

double temperature_C(std::size_t channel, double minute) {
    if (channel == 0) return 18.0 + 0.15 * std::sin(minute / 37.0);
    const double share = 0.25 + 0.04 * static_cast<double>(channel),
                 rise_C = 16.0 / (1.0 + 0.3 * static_cast<double>(channel));
    return 18.0 + rise_C * (-share * std::expm1(-minute / 9.0) - (1.0 - share) * std::expm1(-minute / 46.0));
}

ScanRecord scan_of(std::int64_t scan, std::size_t channels, std::mt19937_64& random) {
    ScanRecord record{scan,
                      ScanStatus::ok,
                      static_cast<double>(scan) * period_s,
                      begun.monotonic_ns + scan * period_ns,
                      {},
                      {},
                      begun.wall_ns + scan * period_ns,
                      {},
                      {}};
    if (scan % 500 == 123) {
        record.status = ScanStatus::missed;
        return record;
    }
    record.started_ns = record.scheduled_ns + 100'000;
    record.finished_ns = record.scheduled_ns + 20'000'000;
    std::normal_distribution<double> noise_C(0.0, 0.05);
    for (std::size_t i = 0; i < channels; ++i) {
        const double value_C =
            std::round(10.0 * (temperature_C(i, record.time_s / 60.0) + noise_C(random))) / 10.0;
        const bool broken = i == 3 && scan % 400 > 395;
        record.samples.push_back(
            broken ? Sample{0x7fff, no_value, Quality::open}
                   : Sample{static_cast<std::uint32_t>(std::lround(10.0 * value_C)), value_C, Quality::good});
    }
    return record;
}

/// As the daemon would have: the shared time constants' figures, a curve of RMSE against n with a minimum.
ChannelVerdict declared(ChannelVerdict verdict) {
    verdict.state = ChannelState::declared;
    verdict.declared_at_min = verdict.window_end_min;
    verdict.n = 20;
    for (int n = 1; n <= 35; ++n) verdict.rmse_by_n_C.push_back(0.02 + 0.0004 * (n - 20) * (n - 20));
    verdict.window_rmse_C = 0.02;
    verdict.svr = {20, verdict.steady_state_C - 0.1, verdict.equilibrium_time_min, 64.0, 4.0};
    verdict.reason = "declared";
    return verdict;
}

template <typename T>
T must(Result<T> result) {
    if (result) {
        if constexpr (std::is_void_v<T>)
            return;
        else
            return std::move(*result);
    }
    std::fprintf(stderr, "write_database: %s\n", result.error().message.c_str());
    std::exit(1);
}

void declare(Store& store, TestId id, std::int64_t window_end_scan, bool hostile) {
    FlowOptions flow;
    flow.sweep_when = SweepWhen::never;
    const TestWindow window = must(store.read().window(id, window_end_scan));
    const WindowVerdict verdicts =
        must(LiveFlow(flow).identify(window, {}, sequential_for, [] { return false; }));
    std::vector<IdentificationRecord> identified;
    for (const ChannelVerdict& one : verdicts.channels) {
        const bool is_last = &one == &verdicts.channels.back();
        ChannelVerdict verdict = is_last ? one : declared(one);
        if (is_last && hostile) verdict.reason = hostile_texts[1];
        const std::string json = verdict_to_json(verdict).dump();
        identified.push_back(
            {verdict.channel, window_end_scan, begun.wall_ns + window_end_scan * period_ns, json});
        if (!verdict.declared()) continue;
        must(store.record_declaration(id, declaration_record(verdict, window_end_scan, json, "0.1.0")));
    }
    must(store.record_identifications(id, identified));
}

void run(const char* path, std::int64_t scans, std::size_t channels, bool hostile) {
    Store store = must(Store::open(path, begun));
    const TestId id = must(store.begin_test(record_of(channels, hostile)));
    std::mt19937_64 random(20150101);
    std::vector<ScanRecord> records;
    for (std::int64_t scan = 0; scan < scans; ++scan) records.push_back(scan_of(scan, channels, random));
    must(store.append_scans(id, records));
    declare(store, id, std::min<std::int64_t>(scans / 3, 640), hostile);
    for (int i = 0; i < 12; ++i) {
        const double time_s = 300.0 * i;
        must(store.record_event({0, id, begun.wall_ns, time_s, i % 3 == 0 ? "annotation" : "started",
                                 i % 4 == 1 ? std::optional(name_of(2, hostile)) : std::nullopt,
                                 hostile ? hostile_texts[i % 5] : "coolant on"}));
    }
    must(store.set_state(id, TestState::declared, {begun.wall_ns + 1, begun.monotonic_ns + 1}, ""));
    must(store.set_state(id, TestState::stopped,
                         {begun.wall_ns + scans * period_ns, begun.monotonic_ns + scans * period_ns},
                         hostile ? hostile_texts[0] : "every required channel is declared"));
}

}  // namespace
}  // namespace thermbal

int main(int argc, char** argv) {
    if (argc < 4) return 2;
    thermbal::run(argv[1], std::atoll(argv[2]), static_cast<std::size_t>(std::atoll(argv[3])), argc > 4);
}
