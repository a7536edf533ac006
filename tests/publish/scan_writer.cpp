// Writes databases as the daemon does, without a module and faster than one: for the tests of what is sent
// on. scan_writer FOLDER DATABASES SCANS EVERY_MS: FOLDER/0.db ... get a scan each EVERY_MS, round by round.
// Every tenth scan is missed, channel T3 is open every seventh; halfway T2 is declared, later withdrawn and
// declared again; at the end a stretch of T1 turns out to have been stuck.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>

#include "store/store.hpp"

namespace {

using namespace thermbal;

constexpr std::size_t channel_count = 16;
constexpr std::int64_t period_ns = 15'000'000'000;

void must(const Result<void>& done) {
    if (done) return;
    fmt::print(stderr, "{}\n", done.error().message);
    std::exit(1);
}

TestRecord test_record(std::int64_t wall_ns) {
    TestRecord test;
    test.name = "written";
    test.machine = "VMC";
    test.version = "0";
    test.boot_id = "boot";
    test.started = {wall_ns, 0};
    for (std::size_t i = 0; i < channel_count; ++i)
        test.channels.push_back({fmt::format("T{}", i + 1), i == 0 ? "ambient" : "structure",
                                 fmt::format("place {}", i), i > 0, "unit 1"});
    return test;
}

Sample sample(std::int64_t scan, std::size_t channel) {
    if (channel == 2 && scan % 7 == 0) return {0x7fff, no_value, Quality::open};
    const auto tenths = static_cast<std::uint32_t>(200 + 10 * channel + static_cast<std::size_t>(scan % 10));
    return {tenths, tenths / 10.0, Quality::good};
}

ScanRecord scan_record(std::int64_t scan, std::int64_t start_wall_ns) {
    ScanRecord record;
    record.scan = scan;
    record.time_s = 15.0 * static_cast<double>(scan);
    record.scheduled_ns = scan * period_ns;
    record.wall_ns = start_wall_ns + scan * period_ns;
    if (scan % 10 == 9) {
        record.status = ScanStatus::missed;
        return record;
    }
    record.started_ns = record.scheduled_ns;
    record.finished_ns = record.scheduled_ns + 40'000'000;
    for (std::size_t i = 0; i < channel_count; ++i) record.samples.push_back(sample(scan, i));
    record.inputs = {{"spindle_rpm", 5000.0}};
    return record;
}

class Database {
  public:
    Database(const std::string& path, std::int64_t wall_ns)
        : wall_ns_(wall_ns),
          store_(std::move(*Store::open(path, {wall_ns, 0}))),
          test_(*store_.begin_test(test_record(wall_ns))) {}

    void write(std::int64_t scan, std::int64_t scans) {
        must(store_.append_scan(test_, scan_record(scan, wall_ns_)));
        if (scan == scans / 2) declare(scan, 26.5);
        if (scan == scans / 2 + 2) must(store_.withdraw_declaration(test_, "T2", "contradicted"));
        if (scan == scans / 2 + 4) declare(scan, 26.75);
        if (scan % 20 == 0) event(scan);
        if (scan % 40 == 0) must(store_.checkpoint());
    }
    void end(std::int64_t scans) {
        const std::vector<std::size_t> first = {0};
        if (!store_.mark_stuck(test_, first, scans / 4, scans / 4 + 5)) std::exit(1);
        must(store_.set_state(test_, TestState::stopped, {wall_ns_ + scans * period_ns, scans * period_ns},
                              "done"));
    }

  private:
    void declare(std::int64_t scan, double steady_state_C) {
        DeclarationRecord declaration;
        declaration.channel = "T2";
        declaration.window_end_scan = scan;
        declaration.declared_at_min = static_cast<double>(scan) / 4.0;
        declaration.n = 20;
        declaration.steady_state_C = steady_state_C;
        must(store_.record_declaration(test_, declaration));
    }
    void event(std::int64_t scan) {
        EventRecord event;
        event.test_id = test_;
        event.wall_ns = wall_ns_ + scan * period_ns;
        event.kind = "annotation";
        event.message = fmt::format("scan {}", scan);
        if (!store_.record_event(event)) std::exit(1);
    }

    std::int64_t wall_ns_;
    Store store_;
    TestId test_;
};

}  // namespace

int main(int argc, char** argv) {
    const std::span arguments(argv, static_cast<std::size_t>(argc));
    if (arguments.size() != 5) return 2;
    const std::string folder = arguments[1];
    const std::int64_t count = std::atoll(arguments[2]);
    const std::int64_t scans = std::atoll(arguments[3]);
    const std::chrono::milliseconds every(std::atoll(arguments[4]));
    const std::int64_t wall_ns = std::chrono::system_clock::now().time_since_epoch().count();
    std::vector<Database> databases;
    for (std::int64_t k = 0; k < count; ++k)
        databases.emplace_back(fmt::format("{}/{}.db", folder, k), wall_ns);
    fmt::print("ready\n");
    std::fflush(stdout);
    auto due = std::chrono::steady_clock::now();
    for (std::int64_t scan = 0; scan < scans; ++scan) {
        for (Database& database : databases) database.write(scan, scans);
        due += every;
        std::this_thread::sleep_until(due);
    }
    for (Database& database : databases) database.end(scans);
    fmt::print("done\n");
    return 0;
}
