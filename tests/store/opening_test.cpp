#include <array>
#include <cstdio>
#include <fstream>
#include <future>
#include <memory>
#include <stop_token>

#include <fcntl.h>
#include <gmock/gmock.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "store/file_check.hpp"
#include "store/store.hpp"
#include "support.hpp"
#include "watched_vfs.hpp"

namespace thermbal::test {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

class OpeningTest : public ::testing::Test {
  protected:
    Folder folder;
    std::filesystem::path path = folder / "thermbal.db";
};

std::string output_of(const std::string& command) {
    std::string text;
    const std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen((command + " 2>&1").c_str(), "r"), pclose);
    std::array<char, 4096> buffer;
    while (const auto count = fread(buffer.data(), 1, buffer.size(), pipe.get()))
        text.append(buffer.data(), count);
    return text;
}

std::vector<ScanRecord> scan_records(std::int64_t count) {
    std::vector<ScanRecord> records;
    for (std::int64_t k = 0; k < count; ++k) records.push_back(scan_record(k));
    return records;
}

void spoil(const std::filesystem::path& path, int first_page, int end_page) {
    std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
    for (int page = first_page; page < end_page; ++page) {
        file.seekp(page * 4096);
        file << std::string(4096, '\x5a');
    }
}

TEST_F(OpeningTest, TheDatabaseIsDurableStrictAndNotForEveryone) {
    const auto store = open_store(path);
    Direct direct(path);
    EXPECT_EQ(direct.integer("SELECT journal_mode = 'wal' FROM pragma_journal_mode"), 1);
    EXPECT_EQ(direct.integer("PRAGMA user_version"), 6);
    EXPECT_EQ(
        direct.integer("SELECT count(*) FROM pragma_table_list WHERE schema = 'main' AND type = 'table' AND "
                       "name NOT LIKE 'sqlite_%' AND NOT strict"),
        0);
    EXPECT_GE(direct.integer("SELECT count(*) FROM pragma_table_list WHERE strict"), 9);
    struct stat file{};
    ASSERT_EQ(stat(path.c_str(), &file), 0);
    EXPECT_EQ(file.st_mode & 0007U, 0U);
}

TEST_F(OpeningTest, ASecondWriterIsRefusedAndToldWhoHasIt) {
    const auto first = open_store(path);
    const auto second = Store::open(path, start);
    ASSERT_FALSE(second);
    EXPECT_EQ(second.error().next, NextStep::refuse_input);
    EXPECT_THAT(second.error().message, HasSubstr(fmt::format("process {}", getpid())));

    const pid_t child = fork();
    if (child == 0) {
        const auto other = Store::open(path, start);
        _exit(!other && other.error().next == NextStep::refuse_input ? 0 : 1);
    }
    int status = 0;
    waitpid(child, &status, 0);
    EXPECT_EQ(status, 0);
}

TEST_F(OpeningTest, TheLockGoesWithTheStore) {
    {
        const auto first = open_store(path);
    }
    EXPECT_TRUE(Store::open(path, start));
}

TEST_F(OpeningTest, AnOlderDatabaseIsBroughtUpWithAllItHolds) {
    {
        Direct direct(path);
        const auto sql =
            contents(std::filesystem::path(THERMBAL_SOURCE_DIR) / "tests/store/fixtures/version_1.sql");
        ASSERT_EQ(direct.run(sql), SQLITE_OK) << direct.message();
        ASSERT_EQ(direct.integer("PRAGMA user_version"), 1);
    }
    const auto too_old = Reader::open(path);
    ASSERT_FALSE(too_old);
    EXPECT_THAT(too_old.error().message, HasSubstr("schema version 1"));

    auto store = open_store(path);
    const auto resumed = store.resume();
    ASSERT_OK(resumed);
    ASSERT_TRUE(resumed->has_value());
    EXPECT_EQ((*resumed)->test.record.name, "from version 1");
    const auto scans = store.read().scans((*resumed)->test.id).value();
    ASSERT_EQ(scans.size(), 2U);
    EXPECT_EQ(scans[1].samples[1].quality, Quality::open);
    ASSERT_OK(store.append_scan((*resumed)->test.id, scan_record(2, 2)));
    EXPECT_THAT(*store.read().archive(""), IsEmpty());
    ASSERT_OK(store.record_archive({}));
    EXPECT_THAT(findings_text(*store.read().verify()), IsEmpty());
}

TEST_F(OpeningTest, AMigratedDatabaseHasTheSchemaOfANewOne) {
    const auto fresh = folder / "fresh.db";
    {
        Direct direct(path);
        ASSERT_EQ(direct.run(contents(std::filesystem::path(THERMBAL_SOURCE_DIR) /
                                      "tests/store/fixtures/version_1.sql")),
                  SQLITE_OK);
    }
    {
        const auto migrated = open_store(path);
    }
    {
        const auto created = open_store(fresh);
    }
    Direct direct(path);
    ASSERT_EQ(direct.run("ATTACH '" + fresh.string() + "' AS fresh"), SQLITE_OK);
    EXPECT_EQ(direct.integer("SELECT count(*) FROM (SELECT type, name, sql FROM main.sqlite_schema EXCEPT "
                             "SELECT type, name, sql FROM fresh.sqlite_schema)"),
              0);
    EXPECT_EQ(direct.integer("SELECT count(*) FROM (SELECT type, name, sql FROM fresh.sqlite_schema EXCEPT "
                             "SELECT type, name, sql FROM main.sqlite_schema)"),
              0);
}

TEST_F(OpeningTest, ANewerDatabaseIsRefusedAndLeftAlone) {
    {
        const auto store = open_store(path);
    }
    {
        Direct(path).run("PRAGMA user_version = 7");
    }
    const auto before = contents(path);
    for (const auto& message :
         {Store::open(path, start).error().message, Reader::open(path).error().message}) {
        EXPECT_THAT(message, HasSubstr("schema version 7"));
        EXPECT_THAT(message, HasSubstr("newer thermbald"));
    }
    EXPECT_EQ(contents(path), before);
}

TEST_F(OpeningTest, SomebodyElsesFileIsRefusedAndLeftAlone) {
    {
        Direct(path).run("CREATE TABLE recipes (name TEXT)");
    }
    EXPECT_THAT(Store::open(path, start).error().message, HasSubstr("not a database of thermbald"));
    EXPECT_THAT(Reader::open(path).error().message, HasSubstr("not a database of thermbald"));

    const auto text = folder / "letter.txt";
    std::ofstream(text) << "Dear reader, this is not a database at all.\n";
    const auto result = Store::open(text, start);
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().next, NextStep::refuse_input);
    EXPECT_EQ(contents(text), "Dear reader, this is not a database at all.\n");
    EXPECT_FALSE(Reader::open(folder / "absent.db"));
    EXPECT_FALSE(std::filesystem::exists(folder / "absent.db"));
    EXPECT_THAT(Store::open("/nonexistent/thermbal.db", start).error().message,
                HasSubstr("folder must exist"));
}

TEST_F(OpeningTest, ADamagedDatabaseIsSetAsideWhole) {
    {
        auto store = open_store(path);
        const auto id = store.begin_test(test_record());
        for (std::int64_t k = 0; k < 200; ++k) ASSERT_OK(store.append_scan(*id, scan_record(k)));
    }
    spoil(path, 10, 14);
    const auto damaged = contents(path);
    const auto kept = Store::open(path, start, {.set_aside_damaged = false});
    ASSERT_FALSE(kept);
    EXPECT_EQ(kept.error().next, NextStep::stop);
    EXPECT_EQ(contents(path), damaged);

    const auto store = open_store(path);
    ASSERT_TRUE(store.set_aside().has_value());
    EXPECT_THAT(store.set_aside()->string(), HasSubstr("thermbal.db.damaged-20231114T221320Z"));
    EXPECT_EQ(contents(*store.set_aside()), damaged);
    EXPECT_THAT(*store.read().tests(), IsEmpty());
}

TEST_F(OpeningTest, ALargeDatabaseIsOpenedFirstAndCheckedBesideTheScans) {
    {
        auto store = open_store(path);
        const auto id = store.begin_test(test_record());
        ASSERT_OK(store.append_scans(*id, scan_records(200)));
        EXPECT_TRUE(store.checked());
    }
    const auto checked = [&] {
        std::promise<Result<bool>> sound;
        const FileCheck check(path, [&](Result<bool> found) { sound.set_value(std::move(found)); });
        return sound.get_future().get();
    };
    const auto store = Store::open(path, start, {.checked_at_once_bytes = 4096});
    ASSERT_OK(store);
    EXPECT_FALSE(store->checked());
    const auto sound = checked();
    ASSERT_OK(sound);
    EXPECT_TRUE(*sound);
    spoil(path, 20, 24);
    const auto spoilt = checked();
    ASSERT_OK(spoilt);
    EXPECT_FALSE(*spoilt);
}

TEST_F(OpeningTest, ACheckThatIsStoppedBeforeItBeginsEndsAtOnce) {
    {
        auto store = open_store(path);
        ASSERT_OK(store.begin_test(test_record()));
    }
    const auto reader = Reader::open(path);
    ASSERT_OK(reader);
    std::stop_source stop;
    stop.request_stop();
    const auto stopped = reader->is_sound(stop.get_token());
    ASSERT_FALSE(stopped);
    EXPECT_EQ(stopped.error().next, NextStep::retry);
    EXPECT_EQ(*reader->is_sound(), true) << "the next one is not";
}

TEST_F(OpeningTest, ATestGoesOnInANewDatabaseWithWhatCanBeRead) {
    constexpr std::int64_t scans = 1500;
    TestId id = 0;
    {
        auto store = open_store(path);
        ASSERT_OK(store.begin_test(test_record()));
        ASSERT_OK(store.set_state(1, TestState::stopped, start, "an earlier test"));
        id = *store.begin_test(test_record());
        ASSERT_OK(store.append_scans(id, scan_records(scans)));
        EventRecord door;
        door.test_id = id;
        door.kind = "annotation";
        door.message = "door open";
        ASSERT_OK(store.record_event(door));
        ASSERT_OK(store.record_archive({.machine = "VMC 850", .test_id = 1}));
    }
    const auto pages = static_cast<int>(std::filesystem::file_size(path) / 4096);
    spoil(path, pages / 2, pages / 2 + 3);
    auto opened = Store::open(path, start, {.checked_at_once_bytes = 4096});
    ASSERT_OK(opened);
    Store store = std::move(*opened);
    const auto aside =
        store.begin_anew({.id = id, .record = test_record(), .reason = {}, .before_scan = scans + 1}, start);
    ASSERT_OK(aside);
    EXPECT_TRUE(std::filesystem::exists(*aside));
    EXPECT_FALSE(std::filesystem::exists(path.string() + ".new"));

    const auto open = store.read().open_test();
    ASSERT_OK(open);
    ASSERT_TRUE(*open);
    EXPECT_EQ((*open)->id, id);
    const auto kept = store.read().scans(id);
    ASSERT_OK(kept);
    ASSERT_EQ(kept->size(), static_cast<std::size_t>(scans) + 1) << "the last one was not given to it yet";
    std::int64_t lost = 0;
    for (const ScanRecord& scan : *kept) {
        if (scan.status == ScanStatus::missed) {
            ++lost;
            continue;
        }
        for (std::size_t c = 0; c < scan.samples.size(); ++c)
            ASSERT_EQ(scan.samples[c].value_C, value_C(scan.scan, c));
    }
    EXPECT_GT(lost, 0) << "three pages are gone";
    EXPECT_LT(lost, scans / 2);
    EXPECT_EQ(store.read().events(id)->size(), 1U);
    EXPECT_EQ(store.read().archive("VMC 850")->size(), 1U);
    ASSERT_OK(store.append_scan(id, scan_record(scans + 1)));
    EXPECT_THAT(findings_text(*store.read().verify()), IsEmpty());
}

DeclarationRecord declaration_of(const std::string& channel, std::int64_t window_end_scan,
                                 double steady_state_C) {
    DeclarationRecord declaration;
    declaration.channel = channel;
    declaration.window_end_scan = window_end_scan;
    declaration.declared_at_min = 62.25;
    declaration.steady_state_C = steady_state_C;
    return declaration;
}

TEST_F(OpeningTest, ANewDatabaseHoldsWhatWasDeclaredAndWhatWasWithdrawn) {
    auto store = open_store(path);
    const auto id = *store.begin_test(test_record());
    ASSERT_OK(store.append_scans(id, scan_records(30)));
    ASSERT_OK(store.record_declaration(id, declaration_of("T5", 10, 24.5)));
    ASSERT_OK(store.withdraw_declaration(id, "T5", "the door was opened"));
    ASSERT_OK(store.record_declaration(id, declaration_of("T5", 20, 25.5)));
    ASSERT_OK(store.record_identifications(
        id, std::array{
                IdentificationRecord{.channel = "T7", .window_end_scan = 29, .verdict_json = "{\"n\":8}"}}));
    ASSERT_OK(store.set_state(id, TestState::declared, start, "all settled"));
    ASSERT_OK(store.begin_anew({.id = id,
                                .record = test_record(),
                                .state = TestState::declared,
                                .reason = "all settled",
                                .before_scan = 30},
                               start));
    const auto resumed = store.resume();
    ASSERT_OK(resumed);
    ASSERT_TRUE(*resumed);
    EXPECT_EQ((*resumed)->test.state, TestState::declared);
    const auto& declared = (*resumed)->declarations;
    ASSERT_EQ(declared.size(), 2U);
    EXPECT_EQ(declared[0].withdrawn, "the door was opened");
    EXPECT_EQ(declared[0].steady_state_C, 24.5);
    EXPECT_EQ(declared[1].withdrawn, "");
    EXPECT_EQ(declared[1].steady_state_C, 25.5);
    ASSERT_EQ((*resumed)->identifications.size(), 1U);
    EXPECT_EQ((*resumed)->identifications[0].verdict_json, "{\"n\":8}");
}

TEST_F(OpeningTest, WhatIsReadAndCannotBeCountsAsNotReadable) {
    auto store = open_store(path);
    const auto id = *store.begin_test(test_record());
    ASSERT_OK(store.append_scans(id, scan_records(30)));
    ASSERT_OK(store.record_declaration(id, declaration_of("T5", 10, 24.5)));
    ASSERT_OK(store.record_declaration(id, declaration_of("T6", 20, 25.5)));
    for (const char* channel : {"T5", "T6"}) {
        const IdentificationRecord said{.channel = channel, .window_end_scan = 29};
        ASSERT_OK(store.record_identifications(id, std::span(&said, 1)));
    }
    for (const char* machine : {"VMC 850", "VMC 1000"})
        ASSERT_OK(store.record_archive({.machine = machine, .test_id = id}));
    EventRecord door;
    door.test_id = id;
    door.kind = "annotation";
    ASSERT_OK(store.record_event(door));
    {
        Direct direct(path);
        ASSERT_EQ(direct.run("PRAGMA ignore_check_constraints = ON;"
                             "UPDATE scans SET time_s = 1e9 WHERE scan = 5;"
                             "UPDATE samples SET value_C = NULL WHERE scan = 7 AND channel = 3;"
                             "UPDATE declarations SET basis = 'Z' WHERE window_end_scan = 10;"
                             "UPDATE identifications SET verdict = 'Z' WHERE channel = 4;"
                             "UPDATE archive SET spectrum = 'Z' WHERE machine = 'VMC 1000';"
                             "UPDATE events SET kind = '' WHERE id = 1;"),
                  SQLITE_OK)
            << direct.message();
    }
    ASSERT_OK(store.begin_anew({.id = id, .record = test_record(), .reason = {}, .before_scan = 30}, start));
    const auto scans = store.read().scans(id);
    ASSERT_OK(scans);
    ASSERT_EQ(scans->size(), 30U);
    for (const ScanRecord& scan : *scans) {
        const bool missed = scan.scan == 5 || scan.scan == 7;
        EXPECT_EQ(scan.status, missed ? ScanStatus::missed : ScanStatus::ok) << scan.scan;
    }
    const auto resumed = store.resume();
    ASSERT_OK(resumed);
    ASSERT_EQ((*resumed)->declarations.size(), 1U);
    EXPECT_EQ((*resumed)->declarations[0].channel, "T6");
    ASSERT_EQ((*resumed)->identifications.size(), 1U);
    EXPECT_EQ((*resumed)->identifications[0].channel, "T6");
    EXPECT_EQ(store.read().archive("")->size(), 1U);
    EXPECT_THAT(findings_text(*store.read().verify()), IsEmpty());
}

/// What the end of the process between the renames of begin_anew leaves: the new one is whole and not in
/// place yet.
class NewDatabaseTest : public OpeningTest {
  protected:
    std::filesystem::path fresh = path.string() + ".new";

    void SetUp() override {
        auto store = open_store(fresh);
        const auto id = store.begin_test(test_record());
        ASSERT_OK(store.append_scans(*id, scan_records(20)));
    }

    void expect_the_test_goes_on() const {
        const auto store = open_store(path);
        const auto resumed = store.resume();
        ASSERT_OK(resumed);
        ASSERT_TRUE(*resumed);
        EXPECT_EQ(store.read().scans((*resumed)->test.id)->size(), 20U);
        EXPECT_FALSE(std::filesystem::exists(fresh));
    }
};

TEST_F(NewDatabaseTest, IsInPlaceAtTheNextStart) {
    expect_the_test_goes_on();
}

TEST_F(NewDatabaseTest, TakesThePlaceOfTheDamagedOneAtTheNextStart) {
    std::ofstream(path) << std::string(8192, '\0');
    expect_the_test_goes_on();
}

TEST_F(NewDatabaseTest, TakesThePlaceOfOneWhoseLogIsSetAsideAlready) {
    const std::string aside = path.string() + ".damaged-20260101T000000Z";
    const std::filesystem::path elsewhere = path.string() + ".old";
    {
        auto old = open_store(elsewhere);
        const auto id = old.begin_test(test_record());
        ASSERT_OK(old.append_scans(*id, scan_records(5)));
    }
    std::filesystem::rename(elsewhere, path);
    std::ofstream(aside + "-wal") << "the last scans";
    expect_the_test_goes_on();
    EXPECT_TRUE(std::filesystem::exists(aside)) << "the old one follows its log";
}

TEST_F(NewDatabaseTest, IsNotTakenWhileTheOldOneIsSound) {
    std::filesystem::copy(fresh, path);
    ASSERT_OK(open_store(path).append_scan(1, scan_record(20)));
    EXPECT_EQ(open_store(path).read().scans(1)->size(), 21U);
}

TEST_F(NewDatabaseTest, IsNotTakenHalfMade) {
    auto still_written = open_store(fresh);
    ASSERT_OK(still_written.append_scan(1, scan_record(20)));
    const auto resumed = open_store(path).resume();
    ASSERT_OK(resumed);
    EXPECT_FALSE(*resumed);
}

TEST_F(OpeningTest, WhereNoNewDatabaseCanBeMadeTheOldOneStays) {
    auto store = open_store(path);
    const auto id = *store.begin_test(test_record());
    ASSERT_OK(store.append_scan(id, scan_record(0)));
    std::filesystem::create_directory(path.string() + ".new");
    std::ofstream(path.string() + ".new/in_the_way") << "x";
    ASSERT_FALSE(
        store.begin_anew({.id = id, .record = test_record(), .reason = {}, .before_scan = 1}, start));
    ASSERT_OK(store.append_scan(id, scan_record(1)));
    EXPECT_EQ(store.read().scans(id)->size(), 2U);
}

class UnfinishedMoveTest : public OpeningTest {
  protected:
    KnownTest known{.id = 1, .record = test_record(), .reason = {}, .before_scan = 1};

    /// The old one is renamed, and the new one cannot be opened in its place.
    Store store_with_unfinished_move() {
        install_watched_vfs();
        auto store = open_store(path);
        EXPECT_EQ(store.begin_test(test_record()), 1);
        EXPECT_TRUE(store.append_scan(1, scan_record(0)));
        refuse_to_open(path.filename());
        EXPECT_FALSE(store.begin_anew(known, start));
        return store;
    }
    ~UnfinishedMoveTest() override { refuse_to_open(""); }

    void expect_scans(std::size_t count) const {
        const auto store = open_store(path);
        const auto resumed = store.resume();
        ASSERT_OK(resumed);
        ASSERT_TRUE(*resumed);
        EXPECT_EQ(store.read().scans(1)->size(), count);
        EXPECT_THAT(findings_text(*store.read().verify()), IsEmpty());
    }
};

TEST_F(UnfinishedMoveTest, NothingIsWrittenBeforeItIsFinished) {
    {
        auto store = store_with_unfinished_move();
        const auto refused = store.append_scan(1, scan_record(1));
        ASSERT_FALSE(refused);
        EXPECT_EQ(refused.error().next, NextStep::retry);
        EXPECT_THAT(refused.error().message, HasSubstr("set aside"));
        EXPECT_FALSE(store.record_event({}));
        EXPECT_FALSE(store.begin_anew(known, start));
        refuse_to_open("");
        const auto aside = store.begin_anew(known, start);
        ASSERT_OK(aside);
        EXPECT_TRUE(std::filesystem::exists(*aside));
        ASSERT_OK(store.append_scan(1, scan_record(1)));
    }
    expect_scans(2);
}

TEST_F(UnfinishedMoveTest, IsFinishedByTheNextStart) {
    {
        const auto store = store_with_unfinished_move();
    }
    refuse_to_open("");
    expect_scans(1);
}

TEST_F(OpeningTest, ADatabaseThatCannotBeRenamedKeepsItsLog) {
    const std::filesystem::path in_the_way = path.string() + ".damaged-20231114T221320Z-shm";
    std::filesystem::create_directory(in_the_way);
    {
        auto store = open_store(path);
        ASSERT_OK(store.begin_test(test_record()));
        ASSERT_OK(store.append_scan(1, scan_record(0)));
        ASSERT_FALSE(
            store.begin_anew({.id = 1, .record = test_record(), .reason = {}, .before_scan = 1}, start));
        ASSERT_OK(store.append_scan(1, scan_record(1)));
    }
    std::filesystem::remove(in_the_way);
    const auto store = open_store(path);
    EXPECT_FALSE(store.set_aside());
    ASSERT_TRUE(*store.resume());
    EXPECT_EQ(store.read().scans(1)->size(), 2U);
}

TEST_F(OpeningTest, WhatTheFileSystemDoesNotAnswerIsAnErrorAndTheOldOneStays) {
    // With what is appended to it, the name is too long to be looked for.
    path = folder / std::string(240, 'd').c_str();
    auto store = open_store(path);
    const auto id = *store.begin_test(test_record());
    ASSERT_OK(store.append_scan(id, scan_record(0)));
    const auto aside =
        store.begin_anew({.id = id, .record = test_record(), .reason = {}, .before_scan = 1}, start);
    ASSERT_FALSE(aside);
    EXPECT_EQ(aside.error().next, NextStep::retry);
    EXPECT_THAT(aside.error().message, HasSubstr("cannot be looked at"));
    ASSERT_OK(store.append_scan(id, scan_record(1)));
    EXPECT_EQ(store.read().scans(id)->size(), 2U);
}

TEST_F(OpeningTest, OtherProgramsReadIt) {
    auto store = open_store(path);
    const auto id = store.begin_test(test_record());
    for (std::int64_t k = 0; k < 4; ++k) ASSERT_OK(store.append_scan(*id, scan_record(k)));
    const std::string sql =
        "SELECT channel, count(*), max(value_C) FROM readings WHERE channel = 'T5' GROUP BY channel";
    const auto python = output_of(std::string(THERMBAL_PYTHON) +
                                  " -c \"import sqlite3; c = sqlite3.connect('file:" + path.string() +
                                  "?mode=ro', uri=True); print(c.execute(\\\"" + sql + "\\\").fetchall())\"");
    EXPECT_EQ(python, "[('T5', 4, 18.403)]\n");
    if (std::filesystem::exists("/usr/bin/sqlite3")) {
        EXPECT_EQ(output_of("/usr/bin/sqlite3 -readonly " + path.string() + " \"" + sql + "\""),
                  "T5|4|18.403\n");
    }
}

/// What systemd's ProtectSystem=strict makes of a folder for one process.
bool make_read_only_for_this_process(const std::filesystem::path& folder) {
    return unshare(CLONE_NEWNS) == 0 && mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0 &&
           mount(folder.c_str(), folder.c_str(), nullptr, MS_BIND, nullptr) == 0 &&
           mount("none", folder.c_str(), nullptr, MS_REMOUNT | MS_BIND | MS_RDONLY, nullptr) == 0;
}

TEST_F(OpeningTest, AReaderInASandboxSeesWhatTheDaemonWrites) {
    if (geteuid() != 0) GTEST_SKIP() << "needs root to mount";
    auto store = open_store(path);
    std::array<int, 2> told{};
    std::array<int, 2> asked{};
    ASSERT_EQ(pipe(told.data()), 0);
    ASSERT_EQ(pipe(asked.data()), 0);
    const pid_t child = fork();
    char byte = 0;
    if (child == 0) {
        if (!make_read_only_for_this_process(path.parent_path())) _exit(77);
        const auto reader = Reader::open(path);
        if (!reader || !reader->tests()->empty() || write(told[1], "r", 1) != 1) _exit(1);
        if (read(asked[0], &byte, 1) != 1) _exit(1);
        _exit(reader->tests()->size() == 1 ? 0 : 2);
    }
    close(told[1]);
    const bool reads = read(told[0], &byte, 1) == 1;
    if (reads) {
        ASSERT_OK(store.begin_test(test_record()));
        ASSERT_EQ(write(asked[1], "w", 1), 1);
    }
    int status = 0;
    waitpid(child, &status, 0);
    for (const int fd : {told[0], asked[0], asked[1]}) close(fd);
    if (WEXITSTATUS(status) == 77) GTEST_SKIP() << "may not mount here";
    EXPECT_EQ(WEXITSTATUS(status), 0);
}

TEST_F(OpeningTest, AnotherUserReadsItWithAndWithoutTheDaemon) {
    if (geteuid() != 0) GTEST_SKIP() << "needs root to become another user";
    const auto reads_as_another_user = [&] {
        const pid_t child = fork();
        if (child == 0) {
            if (setgid(65534) != 0 || setuid(65534) != 0) _exit(3);
            const auto reader = Reader::open(path);
            if (!reader) fprintf(stderr, "%s\n", reader.error().message.c_str());
            _exit(reader && reader->tests() && reader->tests()->size() == 1 ? 0 : 1);
        }
        int status = 0;
        waitpid(child, &status, 0);
        return status == 0;
    };
    {
        auto store = open_store(path);
        ASSERT_OK(store.begin_test(test_record()));
        ASSERT_EQ(chmod(path.parent_path().c_str(), 0755), 0);
        for (const char* suffix : {"", "-wal", "-shm"})
            ASSERT_EQ(chmod((path.string() + suffix).c_str(), 0644), 0);
        EXPECT_TRUE(reads_as_another_user());
    }
    EXPECT_TRUE(reads_as_another_user()) << "after the daemon has ended";
}

}  // namespace
}  // namespace thermbal::test
