#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "declaration/verdict.hpp"
#include "report/plot.hpp"
#include "series/recorded_test.hpp"
#include "series/sample.hpp"

namespace thermbal {

/// One channel of a test. Courses have one value a time of TestReport::time_s, NaN where there is none.
struct ReportChannel {
    std::string name = {};
    std::string place = {};
    bool is_ambient = false;
    bool required = true;
    std::string source = {};                     ///< where it is read, for a person
    std::string calibration = {};                ///< empty: none
    std::optional<ChannelVerdict> verdict = {};  ///< the declaration that stands, or the newest verdict
    std::string withdrawn = {};                  ///< why an earlier declaration does not stand; empty: none
    std::vector<double> expected_C = {};         ///< of the shared time constants on the verdict's window
    std::vector<double> regression_C = {};       ///< the SVR's free run on that window
    std::string no_course = {};         ///< why there is no expected course; empty where there is one
    std::vector<Quality> quality = {};  ///< one a scan
};

struct ReportEvent {
    std::optional<double> time_min = {};
    std::string kind = {};
    std::string channel = {};  ///< empty: of no channel
    std::string message = {};
};

/// All that a report of one test shows. Filled from the database, or from a recording and the live flow.
struct TestReport {
    std::string name = {};
    std::string machine = {};
    std::string source = {};      ///< "test 3 of thermbal.db", "5000.csv"
    std::string started = {};     ///< local time; empty when it is not known
    std::string state = {};       ///< "stopped", "running", ...; "recording" for a file
    std::string end_reason = {};  ///< why it ended
    double tolerance_C = 0.2;
    double tolerance_share_of_rise = 0.0;  ///< a channel may be known to this share of its rise instead
    TestWindow window = {};                ///< what was measured
    std::vector<double> time_s = {};       ///< the window's scans, and times beyond them for the courses
    std::vector<ReportChannel> channels = {};
    std::vector<std::pair<std::string, std::size_t>> scans =
        {};                                ///< how the scans went: "ok" 1200, "missed" 3
    std::vector<ReportEvent> events = {};  ///< oldest first
    bool has_older_events = false;         ///< that are not in `events`
    std::string configuration = {};        ///< TOML; empty for a file
    std::vector<std::pair<std::string, std::string>> versions = {};

    const Column* measured(const ReportChannel& channel) const { return window.channel(channel.name); }
};

/// The answer of a test: what stands on top of a report.
struct TestAnswer {
    enum class Kind { declared, open, none };
    Kind kind = Kind::none;
    std::size_t declared = 0;       ///< of the channels that are waited for
    std::size_t waited_for = 0;     ///< required structural channels that warm
    std::string slowest;            ///< channel that reaches 95 % of its rise last
    double balance_min = no_value;  ///< ... and when, of the declared ones
    double balance_low_min = no_value;
    double balance_high_min = no_value;
    double known_min = no_value;         ///< when the last of them was declared
    double widest_half_C = no_value;     ///< of their 90 % intervals
    std::vector<std::string> undecided;  ///< "T5: its reason", of those waited for

    /// Waiting for 95 % of the rise of the slowest would have taken so much longer than knowing it.
    double saved_min() const { return balance_min - known_min; }
};
TestAnswer answer_of(const TestReport& report);

/// The tables that the report's plots are drawn from, thinned for a screen: "course" (measured, expected,
/// regression, and the measurement less both) and "rmse" (against n).
std::vector<PlotTable> report_tables(const TestReport& report);

/// The whole report as one JSON document: the answer, the channels (each a verdict as in INTERFACES, with
/// place, role and quality), the plots' tables, events, configuration, versions.
nlohmann::json report_to_json(const TestReport& report);

/// The same as one HTML file that needs nothing else.
std::string report_to_html(const TestReport& report);

}  // namespace thermbal
