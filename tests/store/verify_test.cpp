#include <gmock/gmock.h>

#include "store/store.hpp"
#include "support.hpp"

namespace thermbal::test {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// A sound database of ten scans, then one planted fault.
class VerifyTest : public ::testing::Test {
  protected:
    VerifyTest() {
        auto store = open_store(path);
        const auto id = store.begin_test(test_record());
        for (std::int64_t k = 0; k < 10; ++k) (void)store.append_scan(*id, scan_record(k));
        (void)store.set_state(*id, TestState::stopped, {start.wall_ns + 1, start.monotonic_ns + 1}, "done");
    }
    std::string after(const std::string& sql) {
        {
            Direct direct(path);
            EXPECT_EQ(direct.run("PRAGMA ignore_check_constraints = ON; " + sql), SQLITE_OK)
                << direct.message();
        }
        return found();
    }
    std::string found() {
        auto reader = Reader::open(path);
        if (!reader) return reader.error().message;
        const auto findings = reader->verify();
        return findings ? findings_text(*findings) : findings.error().message;
    }
    Folder folder;
    std::filesystem::path path = folder / "thermbal.db";
};

TEST_F(VerifyTest, ASoundDatabaseHasNoFindings) {
    EXPECT_THAT(found(), IsEmpty());
}

TEST_F(VerifyTest, AHoleInTheGrid) {
    EXPECT_THAT(after("DELETE FROM samples WHERE scan IN (3, 4); DELETE FROM inputs WHERE scan IN (3, 4);"
                      "DELETE FROM scans WHERE scan IN (3, 4)"),
                HasSubstr("test 1: scans 3 to 4 have no row"));
}

TEST_F(VerifyTest, AMissingSample) {
    EXPECT_THAT(after("DELETE FROM samples WHERE scan = 5 AND channel = 7"),
                HasSubstr("scan 5: 15 samples of 16 channels"));
}

TEST_F(VerifyTest, AValueWithoutGoodQuality) {
    EXPECT_THAT(after("UPDATE samples SET quality = 'open' WHERE scan = 5 AND channel = 7"),
                HasSubstr("scan 5, channel 7: quality open with a value"));
}

TEST_F(VerifyTest, ARowThatRefersToNothing) {
    EXPECT_THAT(after("INSERT INTO samples (test_id, scan, channel, raw, value_C, quality) VALUES (1, 99, 0, "
                      "1, 20.0, 'good')"),
                HasSubstr("samples: a row refers to scans"));
}

TEST_F(VerifyTest, TimesThatDoNotRise) {
    EXPECT_THAT(after("UPDATE scans SET time_s = 1.0 WHERE scan = 6"),
                HasSubstr("scan 6: time_s 1.0 is not after"));
}

TEST_F(VerifyTest, AReadingInAMissedScan) {
    EXPECT_THAT(
        after("UPDATE scans SET status = 'missed', started_ns = NULL, finished_ns = NULL WHERE scan = 2"),
        HasSubstr("scan 2 was missed, and channel 0 has a reading"));
}

TEST_F(VerifyTest, ADamagedPage) {
    const auto page = Direct(path).integer("SELECT rootpage FROM sqlite_schema WHERE name = 'samples'");
    {
        std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
        file.seekp((page - 1) * 4096);
        file << std::string(2000, '\x5a');
    }
    EXPECT_THAT(found(), HasSubstr("pages and constraints"));
}

}  // namespace
}  // namespace thermbal::test
