#include "database.hpp"

#include <algorithm>
#include <array>
#include <ctime>
#include <filesystem>

#include <fmt/format.h>

#include "columns.hpp"
#include "fields.hpp"
#include "files.hpp"
#include "output.hpp"
#include "progress.hpp"
#include "socket_client.hpp"
#include "store/reader.hpp"

namespace thermbal {
namespace {

using nlohmann::json;

Result<std::string> database_path(const DatabaseOptions& options) {
    if (!options.database.empty()) return options.database;
    const auto unknown = [](const std::string& why) {
        return fail(NextStep::stop, fmt::format("which database? {}; or name it with --database", why));
    };
    auto client = SocketClient::connect(options.ask.socket);
    if (!client) return unknown(client.error().message);
    const auto status = client->ask("status");
    if (!status) return unknown(status.error().message);
    std::string path = text(*status, "database");
    if (path.empty()) return unknown("the daemon does not say");
    return path;
}

/// 0 for a file that is not there.
double size_of(const std::filesystem::path& path) {
    std::error_code error;
    const auto size = std::filesystem::file_size(path, error);
    return error ? 0.0 : static_cast<double>(size);
}

json test_json(const StoredTest& test) {
    const TestRecord& record = test.record;
    return {{"id", test.id},
            {"name", record.name},
            {"machine", record.machine},
            {"state", to_string(test.state)},
            {"started_wall_ns", record.started.wall_ns},
            {"ended_wall_ns", test.ended ? json(test.ended->wall_ns) : json(nullptr)},
            {"scans", test.last_scan.value_or(-1) + 1},
            {"period_s", record.period_s},
            {"channels", record.channels.size()},
            {"reason", test.stop_reason},
            {"version", record.version}};
}

}  // namespace

Result<TestId> wanted_test(const Reader& reader, std::optional<std::int64_t> test) {
    if (test) return *test;
    const auto newest = reader.newest_test();
    if (!newest) return std::unexpected(newest.error());
    if (!*newest) return fail(NextStep::refuse_input, "the database holds no test yet");
    return (*newest)->id;
}

std::string local_time(std::int64_t wall_ns) {
    const auto seconds = static_cast<std::time_t>(wall_ns / 1'000'000'000);
    std::tm local{};
    std::array<char, 32> buffer{};
    if (localtime_r(&seconds, &local) == nullptr) return "-";
    return {buffer.data(), std::strftime(buffer.data(), buffer.size(), "%F %T", &local)};
}

Result<Reader> open_database(const DatabaseOptions& options) {
    const auto path = database_path(options);
    if (!path) return std::unexpected(path.error());
    return Reader::open(*path);
}

int run_tests(const DatabaseOptions& options, std::int64_t limit) {
    const auto reader = open_database(options);
    if (!reader) return report_error(reader.error());
    auto tests = reader->tests(limit + 1);
    if (!tests) return report_error(tests.error());
    const bool has_older = static_cast<std::int64_t>(tests->size()) > limit;
    if (has_older) tests->pop_back();
    if (options.ask.json) {
        json rows = json::array();
        for (const StoredTest& test : *tests) rows.push_back(test_json(test));
        return print_json({{"tests", std::move(rows)}, {"has_older", has_older}});
    }
    if (tests->empty()) return print_text("no tests\n");
    TextTable table({{"id", true},
                     {"started"},
                     {"name"},
                     {"machine"},
                     {"state"},
                     {"scans", true},
                     {"length", true},
                     {"reason"}});
    for (const StoredTest& test : *tests) {
        const std::int64_t scans = test.last_scan.value_or(-1) + 1;
        table.add({std::to_string(test.id), local_time(test.record.started.wall_ns), test.record.name,
                   test.record.machine, std::string(to_string(test.state)), std::to_string(scans),
                   minutes(static_cast<double>(test.last_scan.value_or(0)) * test.record.period_s / 60.0),
                   test.stop_reason});
    }
    return print_text(
        table.str() +
        (has_older ? "and older ones: --limit asks for more than " + std::to_string(limit) + "\n" : ""));
}

int run_export(const DatabaseOptions& options, std::optional<std::int64_t> test, const std::string& csv) {
    const auto reader = open_database(options);
    if (!reader) return report_error(reader.error());
    const auto id = wanted_test(*reader, test);
    if (!id) return report_error(id.error());
    const auto content = reader->csv(*id);
    if (!content) return report_error(content.error());
    if (csv == "-") return print_text(*content);
    const auto written = write_file(csv, *content);
    return written ? 0 : report_error(written.error());
}

int run_verify(const DatabaseOptions& options) {
    const auto reader = open_database(options);
    if (!reader) return report_error(reader.error());
    std::optional<Progress> progress("verify");
    const auto findings = reader->verify();
    progress.reset();
    if (!findings) return report_error(findings.error());
    if (options.ask.json) {
        json rows = json::array();
        for (const Finding& finding : *findings)
            rows.push_back({{"where", finding.where}, {"what", finding.what}});
        const int failed = print_json({{"sound", findings->empty()}, {"findings", std::move(rows)}});
        return findings->empty() ? failed : 1;
    }
    std::string lines = findings->empty() ? "sound\n" : "";
    for (const Finding& finding : *findings) lines += printable(finding.where + ": " + finding.what) + "\n";
    const int failed = print_text(lines);
    return findings->empty() ? failed : 1;
}

int run_backup(const DatabaseOptions& options, const std::string& copy) {
    const auto reader = open_database(options);
    if (!reader) return report_error(reader.error());
    std::optional<Progress> progress("backup");
    progress->follow([whole = size_of(reader->path()), copy] {
        return whole > 0.0 ? std::min(1.0, size_of(copy) / whole) : -1.0;
    });
    const auto done = reader->backup(copy);
    progress.reset();
    if (!done) return report_error(done.error());
    return options.ask.json ? print_json({{"copy", copy}}) : print_text(fmt::format("copied to {}\n", copy));
}

}  // namespace thermbal
