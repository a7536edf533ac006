#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "base/error.hpp"

namespace thermbal {

/// A named series; NaN where there is no (good) sample.
struct Column {
    std::string name;
    std::vector<double> values;
};

/// A recorded test as in a CSV file: one row a scan at strictly increasing times since the spindle started.
/// `channels` are temperatures in C (T1, T2, ...); `inputs` are known inputs (spindle_rpm, ...).
struct RecordedTest {
    std::vector<double> time_s;
    std::vector<Column> channels;
    std::vector<Column> inputs;
};

/// Reads the CSV form of INTERFACES: RFC 4180 with header, first column `time_s`, a channel is `T` and a
/// number, any other column a known input, `#` lines before the header are comments, an empty cell is a
/// missing sample. `name` stands in the messages (file name). Errors (refuse_input) carry line and column;
/// times that stretch the grid of to_window over more than a million scans, and twice the rows, are one of
/// them.
Result<RecordedTest> parse_recorded_test(std::string_view csv_text, std::string_view name);

/// Whether a known input may be called so: letters, digits and '_', no channel's name, not "time_s".
bool is_input_name(std::string_view name);

/// The inverse of parse_recorded_test: shortest digits that read back to the same double, NaN as an empty
/// cell.
std::string format_recorded_test(const RecordedTest& test);

/// A test on the uniform grid of its scans: row k is at start_s + k * period_s. What the identification works
/// on.
struct TestWindow {
    double start_s = 0.0;
    double period_s = 15.0;
    std::size_t scans = 0;
    std::vector<Column> channels;  ///< each of length `scans`, NaN where there is no good sample
    std::vector<Column> inputs;    ///< each of length `scans`, held from the row before

    double time_s(std::size_t scan) const { return start_s + static_cast<double>(scan) * period_s; }
    double end_s() const { return scans == 0 ? start_s : time_s(scans - 1); }
    /// How many of the first scans are at times <= until_s; none where that is NaN.
    std::size_t scans_until(double until_s) const;
    const Column* channel(std::string_view channel_name) const;
    const Column* input(std::string_view input_name) const;
};

/// The scan period of a recording: the median step, in seconds; 0 with fewer than two rows.
double median_step_s(const RecordedTest& test);

/// Puts a recording on the grid of `period_s`, from its first row on: every row goes to the nearest scan,
/// rows that share a scan are averaged, a scan without a row is NaN, an input holds its last value.
TestWindow to_window(const RecordedTest& test, double period_s);

/// The inverse of to_window: a row for each scan.
RecordedTest recording_of(const TestWindow& window);

/// The first scans of a window: those at times <= until_s.
TestWindow window_until(const TestWindow& window, double until_s);

/// The scans of a window at times >= from_s; none where that is NaN.
TestWindow window_from(const TestWindow& window, double from_s);

/// At most `most_scans` scans, each the mean of the good samples of k neighbours at the middle of their
/// times, with the smallest k that does (inputs: the newest value); an incomplete last group is left out. A
/// window that is short enough as it is.
TestWindow coarsened(const TestWindow& window, std::size_t most_scans);

}  // namespace thermbal
