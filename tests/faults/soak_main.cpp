// One row of the soak study: a fault (or "mixture") on one transport, so many times, through the real link,
// line reader, scan assembler, freeze watch and store in lockstep. Prints one JSON object.
// tests/faults/soak.py runs the whole study. Exit status: 0 nothing wrong, 1 something was, 2 wrong usage.
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <poll.h>

#include "acquisition/freeze_watch.hpp"
#include "acquisition/scan.hpp"
#include "injector.hpp"
#include "soaked_line.hpp"
#include "store/store.hpp"

namespace thermbal::soak {
namespace {

struct Options {
    std::string transport = "tcp";
    std::string fault = "mixture";
    std::int64_t times = 1000;
    std::int64_t scans = 0;
    double response_timeout_ms = 50.0;
    std::uint64_t seed = 1;
    Layout layout;
    std::string folder;
    bool unconfirmed = false;
    bool list = false;
};

struct Counts {
    std::int64_t scans = 0;
    std::int64_t injections = 0;
    std::int64_t good_values = 0;
    std::int64_t wrong_values = 0;           ///< stored good, and not the plant's at that scan
    std::int64_t frozen_before_noticed = 0;  ///< of a frozen module, before anybody can know
    std::int64_t longest_unnoticed = 0;      ///< scans
    std::int64_t hangs = 0;
    std::int64_t late_scans = 0;       ///< longer than the bound of the line
    std::int64_t late_recoveries = 0;  ///< clean scans that were not good as a whole
    std::int64_t host_stalls = 0;      ///< such ones while this process was kept from running for long
    std::int64_t clean_scans = 0;
    std::int64_t lost_of_other_unit = 0;  ///< scans in which a unit without a fault gave nothing
    double longest_scan_s = 0.0;
};

constexpr std::int64_t period_ns = 15'000'000'000;
constexpr int hang_ms = 30'000;

TestRecord test_record(const Layout& layout) {
    TestRecord record;
    record.name = "soak";
    record.boot_id = "soak";
    record.version = "soak";
    for (std::size_t c = 0; c < layout.channels(); ++c) {
        ChannelRecord channel;
        channel.name = fmt::format("T{}", c + 1);
        channel.role = "structure";
        record.channels.push_back(std::move(channel));
    }
    return record;
}

std::vector<WatchedModule> modules(const Layout& layout) {
    std::vector<WatchedModule> watched(layout.units);
    for (std::size_t c = 0; c < layout.channels(); ++c)
        watched[c / layout.inputs_per_unit()].channels.push_back(c);
    return watched;
}

ScanRecord record_of(const Scan& scan) {
    ScanRecord record;
    record.scan = scan.scan;
    record.status = scan.status;
    record.time_s = static_cast<double>(scan.scan) * 15.0;
    record.scheduled_ns = scan.due_ns;
    if (scan.status != ScanStatus::missed) {
        record.started_ns = scan.started_ns;
        record.finished_ns = scan.finished_ns;
    }
    record.wall_ns = scan.wall_ns;
    record.samples = scan.samples;
    return record;
}

template <typename T>
T or_exit(Result<T> result) {
    if (result) return std::move(*result);
    fmt::print(stderr, "fault_soak: {}\n", result.error().message);
    std::_Exit(1);
}

class Study {
  public:
    Study(const Options& options, Transport transport, std::vector<FaultDraw> draws)
        : options_(options),
          rig_(transport, options.layout, options.seed),
          line_(rig_, link_options(options)),
          injector_(rig_, std::move(draws), options.response_timeout_ms / 1000.0, options.seed),
          clock_(lockstep_clock(0, period_ns)),
          store_(or_exit(Store::open(options.folder + "/soak.db", {period_ns, 0}))),
          test_(or_exit(store_.begin_test(test_record(options.layout)))),
          freeze_(modules(options.layout)) {}

    Counts run() {
        LineReader reader(0, line_, *clock_, mailbox_);
        const Grid grid{period_ns, period_ns};  // not from 0 on, which a fresh clock has settled already
        ScanAssembler assembler(grid, 1, 0, std::vector<std::size_t>(options_.layout.channels(), 0), 1);
        reader.follow(grid, 1, 0);
        while (!enough()) {
            if (!wait_for_mail()) {
                ++counts_.hangs;
                break;
            }
            for (LineScan& reading : mailbox_.take()) assembler.add(std::move(reading));
            for (Scan& scan : assembler.take_closed(clock_->monotonic_ns(), clock_->wall_ns())) take(scan);
            // The line's thread waits for what is settled here: until then the last scan's facts are ours.
            injector_.before_scan(line_.facts().clean);
            clock_->settled(grid.due_ns(counts_.scans - 1));
        }
        check_stored();
        counts_.injections = injector_.done();
        return counts_;
    }

    double bound_s() const { return line_.bound_s(); }

  private:
    LinkOptions link_options(const Options& options) const {
        LinkOptions link = rig_.link_options(options.response_timeout_ms / 1000.0);
        link.confirm_reads = !options.unconfirmed;
        return link;
    }

    bool enough() const {
        return options_.scans > 0 ? counts_.scans >= options_.scans : injector_.done() >= options_.times;
    }

    /// False when the line hangs: no scan for so long, while the host would have let it run.
    bool wait_for_mail() const {
        pollfd mail{.fd = mailbox_.fd(), .events = POLLIN, .revents = 0};
        while (poll(&mail, 1, hang_ms) == 0) {
            if (line_.host_stalled_s() < hang_ms / 2000.0) return false;
        }
        return true;
    }

    void take(Scan& scan) {
        freeze_.take(scan);
        note_frozen(scan);
        const ScanFacts& facts = line_.facts();
        ++counts_.scans;
        counts_.longest_scan_s = std::max(counts_.longest_scan_s, facts.took_s);
        if (facts.took_s > line_.bound_s() + facts.host_stalled_s) ++counts_.late_scans;
        if (facts.clean) judge_clean(scan, facts);
        note_other_unit(scan);
        const auto stored = store_.append_scan(test_, record_of(scan));
        if (!stored) or_exit(Result<bool>(std::unexpected(stored.error())));
    }

    void judge_clean(const Scan& scan, const ScanFacts& facts) {
        ++counts_.clean_scans;
        if (std::ranges::all_of(scan.samples, &Sample::good)) return;
        // A host that keeps this process from running for half the time that a reply may take.
        const bool stalled = facts.host_stalled_s > options_.response_timeout_ms / 2000.0;
        ++(stalled ? counts_.host_stalls : counts_.late_recoveries);
        std::string last;
        for (const Fault& fault : injector_.current()) last += to_string(fault) + " ";
        fmt::print(stderr, "scan {} after {}is not good: {} (host stalled {:.1f} ms)\n", scan.scan, last,
                   facts.error, facts.host_stalled_s * 1000.0);
    }

    void note_other_unit(const Scan& scan) {
        if (line_.facts().clean || injector_.current().size() != 1 || !injector_.current()[0].unit) return;
        const std::size_t faulty = *injector_.current()[0].unit - 1U;
        for (std::size_t unit = 0; unit < options_.layout.units; ++unit) {
            const Sample& sample = scan.samples[unit * options_.layout.inputs_per_unit()];
            if (unit != faulty && !sample.good()) ++counts_.lost_of_other_unit;
        }
    }

    static bool is_plants(std::uint64_t seed, std::int64_t scan, std::size_t channel, const Sample& sample) {
        const std::int16_t word = plant_word(seed, scan, channel);
        return sample.raw == static_cast<std::uint16_t>(word) && std::abs(sample.value_C - word * 0.1) < 1e-9;
    }

    /// A frozen module gives sound answers: how many of its scans are stored as good before it is noticed.
    void note_frozen(const Scan& scan) {
        if (!injector_.has(FaultKind::frozen)) return;
        bool any = false;
        for (std::size_t c = 0; c < scan.samples.size(); ++c) {
            if (!scan.samples[c].good() || is_plants(options_.seed, scan.scan, c, scan.samples[c])) continue;
            frozen_.emplace_back(scan.scan, c);
            any = true;
        }
        unnoticed_ = any ? unnoticed_ + 1 : 0;
        counts_.longest_unnoticed = std::max(counts_.longest_unnoticed, unnoticed_);
    }

    /// Where a wrong word comes from says how it came in.
    void tell_wrong(std::int64_t scan, std::size_t channel, const Sample& sample) const {
        std::string whence = "of no scan of this channel";
        for (std::int64_t earlier = scan; earlier >= 0; --earlier) {
            if (is_plants(options_.seed, earlier, channel, sample)) {
                whence = fmt::format("the word of {} scans before", scan - earlier);
                break;
            }
        }
        fmt::print(stderr, "scan {}, channel {}: {} is wrong: {}\n", scan, channel, *sample.raw, whence);
    }

    void check_stored() {
        const std::vector<ScanRecord> stored = or_exit(store_.read().scans(test_));
        if (static_cast<std::int64_t>(stored.size()) != counts_.scans) ++counts_.wrong_values;
        std::size_t frozen = 0;
        for (const ScanRecord& scan : stored) {
            for (std::size_t c = 0; c < scan.samples.size(); ++c) {
                if (!scan.samples[c].good()) continue;
                ++counts_.good_values;
                if (is_plants(options_.seed, scan.scan, c, scan.samples[c])) continue;
                const bool known = frozen < frozen_.size() && frozen_[frozen] == std::pair(scan.scan, c);
                ++(known ? counts_.frozen_before_noticed : counts_.wrong_values);
                if (!known) tell_wrong(scan.scan, c, scan.samples[c]);
                if (known) ++frozen;
            }
        }
    }

    const Options& options_;
    Rig rig_;
    SoakedLine line_;
    Injector injector_;
    std::unique_ptr<Clock> clock_;
    Store store_;
    TestId test_;
    FreezeWatch freeze_;
    Mailbox<LineScan> mailbox_;
    Counts counts_;
    std::int64_t unnoticed_ = 0;
    std::vector<std::pair<std::int64_t, std::size_t>> frozen_;
};

nlohmann::ordered_json json_of(const Options& options, const Counts& counts, double bound_s) {
    return {{"fault", options.fault},
            {"transport", options.transport},
            {"units", options.layout.units},
            {"seed", options.seed},
            {"response_timeout_ms", options.response_timeout_ms},
            {"injections", counts.injections},
            {"scans", counts.scans},
            {"good_values", counts.good_values},
            {"wrong_values", counts.wrong_values},
            {"frozen_before_noticed", counts.frozen_before_noticed},
            {"longest_unnoticed_scans", counts.longest_unnoticed},
            {"hangs", counts.hangs},
            {"late_scans", counts.late_scans},
            {"clean_scans", counts.clean_scans},
            {"late_recoveries", counts.late_recoveries},
            {"host_stalls", counts.host_stalls},
            {"lost_of_other_unit", counts.lost_of_other_unit},
            {"longest_scan_ms", std::round(counts.longest_scan_s * 1e4) / 10.0},
            {"bound_ms", std::round(bound_s * 1e4) / 10.0}};
}

int run(const Options& options) {
    const Transport transport = options.transport == "tcp" ? Transport::tcp : Transport::rtu;
    std::vector<FaultDraw> draws = fault_draws(transport, options.layout.units);
    if (options.list) {
        for (const FaultDraw& draw : draws) fmt::print("{}\n", draw.name);
        return 0;
    }
    if (options.fault == "mixture") {
        // What is stored of a frozen module before it is noticed is not the plant's: it has a row of its own.
        std::erase_if(draws, [](const FaultDraw& draw) { return draw.kind == FaultKind::frozen; });
    } else {
        std::erase_if(draws, [&](const FaultDraw& draw) { return draw.name != options.fault; });
    }
    if (draws.empty()) {
        fmt::print(stderr, "fault_soak: '{}' is none of --list\n", options.fault);
        return 2;
    }
    Study study(options, transport, std::move(draws));
    const Counts counts = study.run();
    fmt::print("{}\n", json_of(options, counts, study.bound_s()).dump());
    std::fflush(stdout);
    // The line's thread may hang for good: nothing could join it.
    if (counts.hangs > 0) std::_Exit(1);
    return counts.wrong_values + counts.late_scans + counts.late_recoveries == 0 ? 0 : 1;
}

}  // namespace
}  // namespace thermbal::soak

int main(int argc, char** argv) {
    thermbal::soak::Options options;
    CLI::App app("One fault, so many times, against the real line reader and store.", "fault_soak");
    app.add_option("--transport", options.transport)
        ->check(CLI::IsMember({"tcp", "rtu"}))
        ->capture_default_str();
    app.add_option("--fault", options.fault, "one of --list, or mixture")->capture_default_str();
    app.add_option("--units", options.layout.units)->check(CLI::Range(1, 4))->capture_default_str();
    app.add_option("--times", options.times, "injections")->capture_default_str();
    app.add_option("--scans", options.scans, "end after so many scans instead");
    app.add_option("--response-timeout-ms", options.response_timeout_ms)->capture_default_str();
    app.add_option("--seed", options.seed)->capture_default_str();
    app.add_option("--folder", options.folder, "an empty one, for the database");
    app.add_flag("--unconfirmed", options.unconfirmed, "without LinkOptions::confirm_reads");
    app.add_flag("--list", options.list, "the faults of the transport");
    CLI11_PARSE(app, argc, argv);
    return thermbal::soak::run(options);
}
