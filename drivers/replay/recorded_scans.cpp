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
    const auto row = static_cast<std::size_t>(std::max<std::ptrdiff_t>(rows_until - 1, 0));
    std::vector<double> values;
    values.reserve(test_.channels.size());
    for (const Column& channel : test_.channels) values.push_back(channel.values[row]);
    return values;
}

}  // namespace thermbal
