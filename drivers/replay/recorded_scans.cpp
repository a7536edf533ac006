#include "replay/recorded_scans.hpp"

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <sstream>
#include <system_error>
#include <utility>

#include <fmt/format.h>

namespace thermbal {
namespace {

Result<std::string> read_text(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    std::ostringstream text;
    // A folder opens, and gives no character; an empty file gives none either, and the parser says what it
    // lacks.
    if (file.is_open()) text << file.rdbuf();
    if (file.is_open() && !file.bad()) return std::move(text).str();
    return fail(NextStep::refuse_input, fmt::format("{}: cannot be read ({}); give a recorded test in CSV",
                                                    path, std::generic_category().message(errno)));
}

}  // namespace

Result<RecordedScans> RecordedScans::load(const std::string& path) {
    const Result<std::string> text = read_text(path);
    if (!text) return std::unexpected(text.error());
    Result<RecordedTest> test = parse_recorded_test(*text, path);
    if (!test) return std::unexpected(test.error());
    return from(std::move(*test), path);
}

Result<RecordedScans> RecordedScans::from(RecordedTest test, const std::string& name) {
    if (test.time_s.empty()) {
        return fail(NextStep::refuse_input,
                    fmt::format("{}: has no rows; a recording needs at least one scan", name));
    }
    if (test.channels.empty()) {
        return fail(NextStep::refuse_input,
                    fmt::format("{}: has no temperature channel; name at least one column T1 ... T16", name));
    }
    return RecordedScans(std::move(test));
}

std::vector<double> RecordedScans::at(double time_s) const {
    // Half a millisecond of slack: a scan asked for at its own time must not get the row before it.
    const auto later = std::ranges::upper_bound(test_.time_s, time_s + 5e-4);
    const auto rows_until = later - test_.time_s.begin();
    return row(rows_until == 0 ? 0 : static_cast<std::size_t>(rows_until - 1));
}

std::vector<double> RecordedScans::row(std::size_t scan) const {
    const std::size_t k = std::min(scan, scans() - 1);
    std::vector<double> values;
    values.reserve(test_.channels.size());
    for (const Column& channel : test_.channels) values.push_back(channel.values[k]);
    return values;
}

std::vector<std::string> RecordedScans::channels() const {
    std::vector<std::string> names;
    names.reserve(test_.channels.size());
    for (const Column& channel : test_.channels) names.push_back(channel.name);
    return names;
}

}  // namespace thermbal
