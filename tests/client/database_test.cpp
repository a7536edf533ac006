// thermbalctl's commands on a database that the store itself wrote.
#include <filesystem>
#include <fstream>
#include <sstream>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "program.hpp"
#include "store/store.hpp"

namespace thermbal::test {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

class Database : public ::testing::Test {
  protected:
    void SetUp() override {
        std::string name = (std::filesystem::temp_directory_path() / "thermbal-client-XXXXXX").string();
        folder = mkdtemp(name.data());
        path = folder / "thermbal.db";
        auto store = Store::open(path, {1'700'000'000'000'000'000, 1'000'000'000}).value();
        for (int test = 1; test <= 2; ++test) {
            TestRecord record;
            record.name = fmt::format("run {}", test);
            record.machine = "VMC-3";
            record.version = "0.1.0";
            record.started = {1'700'000'000'000'000'000, 1'000'000'000};
            record.boot_id = "b";
            record.channels = {{"T1", "ambient", "room", true, ""}, {"T2", "structure", "bearing", true, ""}};
            const TestId id = store.begin_test(record).value();
            for (std::int64_t scan = 0; scan < 4 * test; ++scan) store.append_scan(id, scan_of(scan)).value();
            store.set_state(id, TestState::stopped, {1'700'000'900'000'000'000, 901'000'000'000}, "by hand")
                .value();
        }
    }
    void TearDown() override { std::filesystem::remove_all(folder); }

    static ScanRecord scan_of(std::int64_t scan) {
        const std::int64_t ns = 1'000'000'000 + scan * 15'000'000'000;
        const Sample open{32767, no_value, Quality::open};
        const double value_C = 20.0 + 0.5 * static_cast<double>(scan);
        ScanRecord record;
        record.scan = scan;
        record.time_s = 15.0 * static_cast<double>(scan);
        record.scheduled_ns = ns;
        record.started_ns = ns;
        record.finished_ns = ns + 1'000'000;
        record.wall_ns = 1'700'000'000'000'000'000 + ns;
        record.samples = {{180, 18.0, Quality::good}, scan == 2 ? open : Sample{1, value_C, Quality::good}};
        return record;
    }

    std::filesystem::path folder;
    std::filesystem::path path;
};

TEST_F(Database, ListsItsTestsNewestFirst) {
    const Output text = run(fmt::format("tests --database {}", path.string()));
    EXPECT_EQ(text.status, 0) << text.text;
    EXPECT_THAT(text.text, HasSubstr("run 2"));
    const json tests =
        json::parse(run(fmt::format("tests --json --database {}", path.string())).text)["tests"];
    ASSERT_EQ(tests.size(), 2U);
    EXPECT_EQ(tests[0]["id"], 2);
    EXPECT_EQ(tests[0]["scans"], 8);
    EXPECT_EQ(tests[1]["state"], "stopped");
    EXPECT_EQ(tests[1]["reason"], "by hand");
}

TEST_F(Database, ExportsATestAsCsvWithAnEmptyCellForWhatWasNotGood) {
    const Output first = run(fmt::format("export --csv - --test 1 --database {}", path.string()));
    EXPECT_EQ(first.status, 0);
    const std::string rows = first.text.substr(first.text.find("time_s"));
    EXPECT_EQ(rows.substr(0, rows.find('\n')).substr(0, 12), "time_s,T1,T2");
    EXPECT_THAT(rows, HasSubstr("\r\n15,18,20.5\r\n"));
    EXPECT_THAT(rows, HasSubstr("\r\n30,18,\r\n"));
    EXPECT_EQ(std::ranges::count(rows, '\n'), 5);

    const auto file = folder / "newest.csv";
    EXPECT_EQ(run(fmt::format("export --csv {} --database {}", file.string(), path.string())).status, 0);
    std::stringstream content;
    content << std::ifstream(file).rdbuf();
    EXPECT_THAT(content.str(), HasSubstr("\r\n105,18,23.5\r\n"));
}

TEST_F(Database, ATestThatIsNotThereIsRefused) {
    const Output none = run(fmt::format("export --csv - --test 9 --database {}", path.string()));
    EXPECT_EQ(none.status, 2);
    EXPECT_EQ(std::ranges::count(none.text, '\n'), 1) << none.text;
}

TEST_F(Database, IsVerifiedAndCopiedOnlyToANewFile) {
    EXPECT_EQ(run(fmt::format("verify --database {}", path.string())).text, "sound\n");
    const auto copy = folder / "copy.db";
    const std::string command = fmt::format("backup {} --database {}", copy.string(), path.string());
    EXPECT_EQ(run(command).status, 0);
    EXPECT_EQ(json::parse(run(fmt::format("verify --json --database {}", copy.string())).text),
              json({{"sound", true}, {"findings", json::array()}}));
    EXPECT_NE(run(command).status, 0);
}

TEST_F(Database, AScanThatIsMissingInTheFileIsFound) {
    ASSERT_EQ(
        std::system(fmt::format("{} -c \"import sqlite3; d = sqlite3.connect('{}'); d.execute('DELETE FROM "
                                "samples WHERE scan = 1'); d.commit()\"",
                                THERMBAL_PYTHON, path.string())
                        .c_str()),
        0);
    const Output found = run(fmt::format("verify --database {}", path.string()));
    EXPECT_EQ(found.status, 1);
    EXPECT_THAT(found.text, HasSubstr("1"));
    EXPECT_NE(found.text, "sound\n");
}

}  // namespace
}  // namespace thermbal::test
