#pragma once

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sqlite3.h>
#include <stdlib.h>

#include "store/store.hpp"

namespace thermbal::test {

constexpr std::int64_t period_ns = 15'000'000'000;
constexpr Moment start{1'700'000'000'000'000'000, 5'000'000'000};

/// Where a file costs no disk: for what is opened hundreds of times.
inline std::filesystem::path memory_folder() {
    return std::filesystem::is_directory("/dev/shm") ? "/dev/shm" : std::filesystem::temp_directory_path();
}

class Folder {
  public:
    explicit Folder(const std::filesystem::path& parent = std::filesystem::temp_directory_path()) {
        std::string name = (parent / "thermbal-store-XXXXXX").string();
        path_ = mkdtemp(name.data());
    }
    Folder(const Folder&) = delete;
    Folder& operator=(const Folder&) = delete;
    ~Folder() {
        std::error_code ignored;
        std::filesystem::remove_all(path_, ignored);
    }
    std::filesystem::path operator/(const char* name) const { return path_ / name; }

  private:
    std::filesystem::path path_;
};

inline TestRecord test_record(std::size_t channels = 16) {
    TestRecord test;
    test.name = "idle 5000 r/min";
    test.machine = "VMC 850";
    test.config_toml = "[test]\nname = \"idle\"\n";
    test.version = "0.1.0";
    test.started = start;
    test.boot_id = "4a0c";
    for (std::size_t i = 0; i < channels; ++i) {
        ChannelRecord channel;
        channel.name = fmt::format("T{}", i + 1);
        channel.role = i == 0 ? "ambient" : "machine";
        channel.place = "front bearing";
        channel.source = fmt::format("unit 1, input {}", i);
        test.channels.push_back(channel);
    }
    return test;
}

/// A value that names its scan and channel, so that a row in the wrong place is seen.
inline double value_C(std::int64_t scan, std::size_t channel) {
    return 18.0 + 0.1 * static_cast<double>(channel) + 0.001 * static_cast<double>(scan);
}

inline ScanRecord scan_record(std::int64_t scan, std::size_t channels = 16) {
    ScanRecord record;
    record.scan = scan;
    record.time_s = 15.0 * static_cast<double>(scan) + 0.02;
    record.scheduled_ns = start.monotonic_ns + scan * period_ns;
    record.started_ns = record.scheduled_ns + 20'000'000;
    record.finished_ns = record.scheduled_ns + 45'000'000;
    record.wall_ns = start.wall_ns + scan * period_ns;
    for (std::size_t i = 0; i < channels; ++i)
        record.samples.push_back({static_cast<std::uint32_t>(180 + i), value_C(scan, i), Quality::good});
    record.inputs = {{"spindle_rpm", 5000.0}};
    return record;
}

inline ScanRecord missed_scan(std::int64_t scan) {
    ScanRecord record = scan_record(scan);
    record.status = ScanStatus::missed;
    record.started_ns.reset();
    record.finished_ns.reset();
    record.samples.clear();
    record.inputs.clear();
    return record;
}

/// The database as SQLite itself sees it, beside the store.
class Direct {
  public:
    explicit Direct(const std::filesystem::path& path) {
        EXPECT_EQ(sqlite3_open(path.c_str(), &handle_), SQLITE_OK);
        sqlite3_busy_timeout(handle_, 2000);
    }
    Direct(const Direct&) = delete;
    Direct& operator=(const Direct&) = delete;
    ~Direct() { sqlite3_close(handle_); }

    int run(const std::string& sql) { return sqlite3_exec(handle_, sql.c_str(), nullptr, nullptr, nullptr); }
    std::string message() const { return sqlite3_errmsg(handle_); }
    std::int64_t integer(const std::string& sql) {
        sqlite3_stmt* statement = nullptr;
        EXPECT_EQ(sqlite3_prepare_v2(handle_, sql.c_str(), -1, &statement, nullptr), SQLITE_OK) << message();
        EXPECT_EQ(sqlite3_step(statement), SQLITE_ROW) << sql;
        const auto value = sqlite3_column_int64(statement, 0);
        sqlite3_finalize(statement);
        return value;
    }

  private:
    sqlite3* handle_ = nullptr;
};

inline std::string contents(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    std::ostringstream text;
    text << file.rdbuf();
    return text.str();
}

#define ASSERT_OK(expression)                                \
    do {                                                     \
        const auto& ok_result = (expression);                \
        ASSERT_TRUE(ok_result) << ok_result.error().message; \
    } while (false)

inline Store open_store(const std::filesystem::path& path) {
    auto store = Store::open(path, start);
    if (!store) throw std::runtime_error(store.error().message);
    return std::move(*store);
}

inline std::string findings_text(const std::vector<Finding>& findings) {
    std::string text;
    for (const auto& finding : findings) text += finding.where + ": " + finding.what + "\n";
    return text;
}

}  // namespace thermbal::test
