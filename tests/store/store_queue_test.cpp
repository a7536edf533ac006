#include "store/store_queue.hpp"

#include <gmock/gmock.h>

#include "support.hpp"
#include "watched_vfs.hpp"

namespace thermbal::test {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

class StoreQueueTest : public ::testing::TestWithParam<WriteFault> {
  protected:
    StoreQueueTest() {
        install_watched_vfs();
        id = *queue.store().begin_test(test_record());
    }
    ~StoreQueueTest() override { set_write_fault(WriteFault::none); }

    std::vector<StorageNews::Kind> news() {
        std::vector<StorageNews::Kind> kinds;
        for (const StorageNews& one : queue.take_news()) kinds.push_back(one.kind);
        return kinds;
    }
    void append(std::int64_t scan) {
        queue.append_scan(id, scan_record(scan));
        queue.flush();
    }
    std::size_t stored() const { return queue.store().read().scans(id)->size(); }

    Folder folder;
    StoreQueue queue{(install_watched_vfs(), open_store(folder / "thermbal.db")),
                     {.scans = 50, .others = 20}};
    TestId id = 0;
};

TEST_P(StoreQueueTest, AnOutageIsSaidOnceAndItsScansAreWrittenWhenItEnds) {
    append(0);
    EXPECT_THAT(news(), IsEmpty());
    set_write_fault(GetParam());
    for (std::int64_t scan = 1; scan <= 30; ++scan) {
        append(scan);
        queue.write([this, scan](Store& store) -> Result<void> {
            EventRecord note;
            note.test_id = id;
            note.kind = "note";
            note.message = fmt::format("behind scan {}", scan);
            const auto event = store.record_event(note);
            return event ? Result<void>() : std::unexpected(event.error());
        });
    }
    EXPECT_THAT(news(), ::testing::ElementsAre(StorageNews::Kind::away));
    EXPECT_FALSE(queue.problem().empty());
    EXPECT_EQ(queue.unstored_scans(), 30U);
    EXPECT_EQ(stored(), 1U);

    set_write_fault(WriteFault::none);
    append(31);
    EXPECT_THAT(news(), ::testing::ElementsAre(StorageNews::Kind::back));
    EXPECT_EQ(stored(), 32U);
    EXPECT_EQ(queue.unstored_writes(), 0U);
    EXPECT_THAT(queue.problem(), IsEmpty());
    EXPECT_EQ(queue.lost_scans(), 0U);
    // 20 of the 30 notes: the bound on what is no scan.
    EXPECT_EQ(queue.store().read().events(id)->size(), 20U);
    EXPECT_THAT(findings_text(*queue.store().read().verify()), IsEmpty());
}

TEST_P(StoreQueueTest, WhatDoesNotFitBecomesAGapOfTheGrid) {
    set_write_fault(GetParam());
    for (std::int64_t scan = 0; scan < 70; ++scan) append(scan);
    EXPECT_EQ(queue.unstored_scans(), 50U);
    EXPECT_EQ(queue.lost_scans(), 20U);
    set_write_fault(WriteFault::none);
    queue.flush();
    const auto scans = queue.store().read().scans(id);
    ASSERT_OK(scans);
    ASSERT_EQ(scans->size(), 70U);
    EXPECT_EQ((*scans)[19].status, ScanStatus::missed);
    EXPECT_EQ((*scans)[20].status, ScanStatus::ok);
    EXPECT_THAT(findings_text(*queue.store().read().verify()), IsEmpty());
}

INSTANTIATE_TEST_SUITE_P(Faults, StoreQueueTest,
                         ::testing::Values(WriteFault::full, WriteFault::io_error, WriteFault::sync_error,
                                           WriteFault::read_only));

TEST_F(StoreQueueTest, ALockOfAnotherProgramIsWaitedForAndThenHeldInMemory) {
    Direct other(folder / "thermbal.db");
    queue.store() = *Store::open(folder / "other.db", start, {.busy_timeout_ms = 50});
    id = *queue.store().begin_test(test_record());
    Direct locker(folder / "other.db");
    ASSERT_EQ(locker.run("BEGIN IMMEDIATE"), SQLITE_OK);
    append(0);
    append(1);
    EXPECT_THAT(queue.problem(), HasSubstr("another program holds a lock"));
    ASSERT_EQ(locker.run("COMMIT"), SQLITE_OK);
    append(2);
    EXPECT_EQ(stored(), 3U);
}

TEST_F(StoreQueueTest, MissedScansWaitForWhatComesNext) {
    for (std::int64_t scan = 0; scan < 300; ++scan) {
        ScanRecord missed = scan_record(scan);
        missed.status = ScanStatus::missed;
        missed.started_ns.reset();
        missed.finished_ns.reset();
        missed.samples.clear();
        queue.append_scan(id, std::move(missed));
    }
    EXPECT_EQ(stored(), 0U);
    EXPECT_EQ(queue.unstored_scans(), 0U) << "nothing of a missed scan can be lost";
    queue.append_scan(id, scan_record(300));
    EXPECT_EQ(stored(), 301U);
}

TEST_F(StoreQueueTest, ATableThatAnotherProgramAlteredIsNoDamage) {
    append(0);
    Direct other(folder / "thermbal.db");
    ASSERT_EQ(other.run("ALTER TABLE samples RENAME TO mine"), SQLITE_OK) << other.message();
    append(1);
    append(2);
    EXPECT_FALSE(queue.damaged());
    EXPECT_THAT(news(), ::testing::ElementsAre(StorageNews::Kind::away));
    EXPECT_THAT(queue.problem(), HasSubstr("another program"));
    EXPECT_EQ(queue.unstored_scans(), 2U);
    ASSERT_EQ(other.run("ALTER TABLE mine RENAME TO samples"), SQLITE_OK) << other.message();
    append(3);
    EXPECT_EQ(queue.unstored_scans(), 0U);
    EXPECT_EQ(stored(), 4U);
    EXPECT_THAT(findings_text(*queue.store().read().verify()), IsEmpty());
}

TEST_F(StoreQueueTest, ARefusedScanHoldsUpNothingAndIsTriedAgain) {
    append(0);
    Direct other(folder / "thermbal.db");
    ASSERT_EQ(other.run("CREATE TRIGGER no_scan_1 BEFORE INSERT ON scans WHEN new.scan = 1 "
                        "BEGIN SELECT RAISE(ABORT, 'not this one'); END"),
              SQLITE_OK);
    for (std::int64_t scan = 1; scan <= 5; ++scan) append(scan);
    EXPECT_EQ(queue.refused_writes(), 1U);
    EXPECT_THAT(news(), ::testing::ElementsAre(StorageNews::Kind::refused));
    EXPECT_EQ(stored(), 5U) << "the others are stored";
    ASSERT_EQ(other.run("DROP TRIGGER no_scan_1"), SQLITE_OK);
    for (std::int64_t scan = 6; scan < 50; ++scan) append(scan);
    EXPECT_EQ(queue.refused_writes(), 0U);
    EXPECT_EQ(stored(), 50U);
    EXPECT_EQ(queue.lost_scans(), 0U);
    EXPECT_THAT(findings_text(*queue.store().read().verify()), IsEmpty());
}

TEST_F(StoreQueueTest, WhatWaitsIsWrittenBehindWhatCouldBeReadOfADamagedDatabase) {
    for (std::int64_t scan = 0; scan <= 3; ++scan) append(scan);
    set_write_fault(WriteFault::io_error);
    for (std::int64_t scan = 4; scan <= 6; ++scan) append(scan);
    const KnownTest known{.id = id, .record = test_record(), .reason = {}, .before_scan = 7};
    queue.note_damage();
    EXPECT_TRUE(queue.damaged());
    EXPECT_FALSE(queue.begin_anew(known, start)) << "the disk takes no other file either";
    EXPECT_TRUE(queue.damaged()) << "to be tried again";
    EXPECT_EQ(queue.unstored_scans(), 3U);

    set_write_fault(WriteFault::none);
    EXPECT_TRUE(queue.begin_anew(known, start));
    EXPECT_FALSE(queue.damaged());
    EXPECT_THAT(news(), ::testing::ElementsAre(StorageNews::Kind::away, StorageNews::Kind::set_aside,
                                               StorageNews::Kind::back));
    const auto scans = queue.store().read().scans(id);
    ASSERT_OK(scans);
    ASSERT_EQ(scans->size(), 7U);
    for (const ScanRecord& scan : *scans) {
        EXPECT_EQ(scan.status, ScanStatus::ok) << "no gap where a scan only waited";
        EXPECT_EQ(scan.samples[4].value_C, value_C(scan.scan, 4));
    }
    EXPECT_EQ(queue.unstored_scans(), 0U);
}

TEST_F(StoreQueueTest, WhatWaitsOfATestThatEndedMeanwhileIsStored) {
    for (std::int64_t scan = 0; scan <= 3; ++scan) append(scan);
    set_write_fault(WriteFault::io_error);
    append(4);
    queue.set_state(id, TestState::running, TestState::declared, start, "all settled");
    append(5);
    queue.set_state(id, TestState::declared, TestState::stopped, start, "all settled");
    set_write_fault(WriteFault::none);
    ASSERT_TRUE(queue.begin_anew({.id = id,
                                  .record = test_record(),
                                  .state = TestState::stopped,
                                  .reason = "all settled",
                                  .before_scan = 6},
                                 start));
    EXPECT_EQ(queue.refused_writes(), 0U);
    EXPECT_EQ(queue.unstored_writes(), 0U);
    EXPECT_THAT(news(), ::testing::ElementsAre(StorageNews::Kind::away, StorageNews::Kind::set_aside,
                                               StorageNews::Kind::back));
    const auto test = queue.store().read().test(id);
    ASSERT_OK(test);
    EXPECT_EQ(test->state, TestState::stopped);
    EXPECT_EQ(test->stop_reason, "all settled");
    EXPECT_EQ(stored(), 6U);
    EXPECT_THAT(findings_text(*queue.store().read().verify()), IsEmpty());
}

TEST_F(StoreQueueTest, ATestWhoseDeclarationWaitsIsNotRefusedIt) {
    append(0);
    set_write_fault(WriteFault::io_error);
    append(1);
    queue.set_state(id, TestState::running, TestState::declared, start, "all settled");
    set_write_fault(WriteFault::none);
    ASSERT_TRUE(queue.begin_anew({.id = id,
                                  .record = test_record(),
                                  .state = TestState::declared,
                                  .reason = "all settled",
                                  .before_scan = 2},
                                 start));
    EXPECT_EQ(queue.refused_writes(), 0U);
    EXPECT_EQ(queue.store().read().test(id)->state, TestState::declared);
    EXPECT_EQ(stored(), 2U);
}

TEST_F(StoreQueueTest, ADamageWhoseNewDatabaseCannotBeMadeIsTriedAgain) {
    append(0);
    set_write_fault(WriteFault::full);
    EXPECT_FALSE(
        queue.begin_anew({.id = id, .record = test_record(), .reason = {}, .before_scan = 1}, start));
    set_write_fault(WriteFault::none);
    append(1);
    EXPECT_EQ(stored(), 2U) << "the old one still takes scans";
    EXPECT_TRUE(queue.damaged());
}

TEST_F(StoreQueueTest, OfWhatHasAKeyOnlyTheNewestWaits) {
    set_write_fault(WriteFault::full);
    append(0);
    int written = -1;
    for (int i = 0; i < 10; ++i) {
        queue.write(
            [&written, i](Store&) {
                written = i;
                return Result<void>();
            },
            "newest");
    }
    EXPECT_EQ(queue.unstored_writes(), 2U);
    set_write_fault(WriteFault::none);
    queue.flush();
    EXPECT_EQ(written, 9);
}

}  // namespace
}  // namespace thermbal::test
