#include "store/store.hpp"

#include <atomic>
#include <bit>
#include <csignal>
#include <thread>

#include <gmock/gmock.h>
#include <sys/resource.h>
#include <sys/wait.h>

#include "support.hpp"

namespace thermbal::test {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

class StoreTest : public ::testing::Test {
  protected:
    Folder folder;
    std::filesystem::path path = folder / "thermbal.db";
};

TEST_F(StoreTest, AScanComesBackAsItWas) {
    auto store = open_store(path);
    const auto id = store.begin_test(test_record(3));
    ASSERT_OK(id);
    ScanRecord scan = scan_record(0, 3);
    scan.status = ScanStatus::late;
    scan.samples[1] = {30000U, no_value, Quality::open};
    scan.samples[2] = {std::nullopt, no_value, Quality::communication};
    scan.samples[0].raw = 0xffffffffU;
    scan.inputs = {{"spindle_load_pct", 12.5}, {"spindle_rpm", 5000.0}};
    ASSERT_OK(store.append_scan(*id, scan));

    const auto scans = store.read().scans(*id);
    ASSERT_OK(scans);
    ASSERT_EQ(scans->size(), 1U);
    const auto& back = scans->front();
    EXPECT_EQ(back.status, ScanStatus::late);
    EXPECT_EQ(back.time_s, scan.time_s);
    EXPECT_EQ(back.scheduled_ns, scan.scheduled_ns);
    EXPECT_EQ(back.started_ns, scan.started_ns);
    EXPECT_EQ(back.finished_ns, scan.finished_ns);
    EXPECT_EQ(back.wall_ns, scan.wall_ns);
    ASSERT_EQ(back.samples.size(), 3U);
    EXPECT_EQ(back.samples[0].raw, 0xffffffffU);
    EXPECT_EQ(back.samples[0].value_C, scan.samples[0].value_C);
    EXPECT_TRUE(back.samples[0].good());
    EXPECT_EQ(back.samples[1].raw, 30000U);
    EXPECT_EQ(back.samples[1].quality, Quality::open);
    EXPECT_TRUE(std::isnan(back.samples[1].value_C));
    EXPECT_EQ(back.samples[2].raw, std::nullopt);
    EXPECT_EQ(back.samples[2].quality, Quality::communication);
    ASSERT_EQ(back.inputs.size(), 2U);
    EXPECT_EQ(back.inputs[1].name, "spindle_rpm");
    EXPECT_EQ(back.inputs[1].value, 5000.0);
}

TEST_F(StoreTest, AMissedScanIsARowWithAGapForEachChannel) {
    auto store = open_store(path);
    const auto id = store.begin_test(test_record());
    ASSERT_OK(store.append_scan(*id, scan_record(0)));
    ASSERT_OK(store.append_scan(*id, missed_scan(1)));
    ASSERT_OK(store.append_scan(*id, scan_record(2)));
    const auto scans = store.read().scans(*id, 1, 1);
    ASSERT_OK(scans);
    ASSERT_EQ(scans->size(), 1U);
    EXPECT_EQ(scans->front().status, ScanStatus::missed);
    EXPECT_EQ(scans->front().started_ns, std::nullopt);
    ASSERT_EQ(scans->front().samples.size(), 16U);
    for (const auto& sample : scans->front().samples) EXPECT_EQ(sample.quality, Quality::gap);
    EXPECT_THAT(findings_text(*store.read().verify()), IsEmpty());
}

TEST_F(StoreTest, TheWindowHasNaNWhereNothingGoodWasRead) {
    auto store = open_store(path);
    const auto id = store.begin_test(test_record(2));
    for (std::int64_t k : {0, 1, 3, 4}) {
        ScanRecord scan = scan_record(k, 2);
        if (k == 1) scan.samples[1] = {30000U, no_value, Quality::open};
        if (k == 4) scan.inputs.clear();
        ASSERT_OK(store.append_scan(*id, scan));
    }
    const auto window = store.read().window(*id);
    ASSERT_OK(window);
    EXPECT_EQ(window->scans, 5U);
    EXPECT_EQ(window->period_s, 15.0);
    EXPECT_EQ(window->start_s, 0.0);
    const auto& t2 = window->channel("T2")->values;
    EXPECT_EQ(t2[0], value_C(0, 1));
    EXPECT_TRUE(std::isnan(t2[1]));
    EXPECT_TRUE(std::isnan(t2[2])) << "scan 2 has no row";
    EXPECT_EQ(t2[4], value_C(4, 1));
    EXPECT_EQ(window->input("spindle_rpm")->values[4], 5000.0) << "an input holds its last value";

    const auto earlier = store.read().window(*id, 1);
    ASSERT_OK(earlier);
    EXPECT_EQ(earlier->scans, 2U);
}

TEST_F(StoreTest, CsvIsTheRecordedTest) {
    auto store = open_store(path);
    const auto id = store.begin_test(test_record(2));
    ASSERT_OK(store.append_scan(*id, scan_record(0, 2)));
    ASSERT_OK(store.append_scan(*id, missed_scan(1)));
    const auto csv = store.read().csv(*id);
    ASSERT_OK(csv);
    const auto recorded = parse_recorded_test(*csv, "exported");
    ASSERT_OK(recorded);
    ASSERT_EQ(recorded->time_s.size(), 2U);
    EXPECT_EQ(recorded->channels[1].name, "T2");
    EXPECT_EQ(recorded->channels[1].values[0], value_C(0, 1));
    EXPECT_TRUE(std::isnan(recorded->channels[1].values[1]));
    EXPECT_EQ(recorded->inputs[0].name, "spindle_rpm");
}

TEST_F(StoreTest, ValuesOfAScanThatIsNotThereAreAnError) {
    auto store = open_store(path);
    const auto id = store.begin_test(test_record(2));
    for (std::int64_t k = 0; k < 4; ++k) ASSERT_OK(store.append_scan(*id, scan_record(k, 2)));
    Direct direct(path);
    // Of the last scan, and of one between: neither has a place.
    for (const char* gone : {"DELETE FROM scans WHERE scan = 3", "DELETE FROM scans WHERE scan = 1"}) {
        ASSERT_EQ(direct.run(gone), SQLITE_OK) << direct.message();
        const auto recorded = store.read().recorded_test(*id);
        ASSERT_FALSE(recorded);
        EXPECT_EQ(recorded.error().next, NextStep::stop);
        EXPECT_THAT(recorded.error().message, HasSubstr("run verify"));
        ASSERT_EQ(direct.run("DELETE FROM samples WHERE scan = 3; DELETE FROM inputs WHERE scan = 3"),
                  SQLITE_OK);
    }
    ASSERT_EQ(direct.run("UPDATE samples SET scan = -1 WHERE scan = 0"), SQLITE_OK) << direct.message();
    EXPECT_FALSE(store.read().window(*id));
    EXPECT_FALSE(store.read().window(*id, -5));
}

TEST_F(StoreTest, WhatATestWasBegunWithAndWhatTheModuleSaidStandBesideItsValues) {
    auto store = open_store(path);
    TestRecord record = test_record(2);
    record.channels[1].calibration = "certificate K-2231: R0 100.012 ohm";
    record.model_toml = "[model]\nname = \"head\"\n";
    record.model_file = "/home/eng/head.toml";
    const auto id = store.begin_test(record);
    ScanRecord scan = scan_record(0, 2);
    scan.samples[1].source_C = 18.25;
    ASSERT_OK(store.append_scan(*id, scan));
    const auto scans = store.read().scans(*id);
    ASSERT_OK(scans);
    EXPECT_TRUE(std::isnan(scans->front().samples[0].source_C));
    EXPECT_EQ(scans->front().samples[1].source_C, 18.25);
    EXPECT_EQ(scans->front().samples[1].value_C, value_C(0, 1));
    EXPECT_EQ(store.read().test(*id)->record.channels[1].calibration, record.channels[1].calibration);
    EXPECT_EQ(Direct(path).integer("SELECT count(*) FROM readings WHERE source_C = 18.25"), 1);
    EXPECT_EQ(store.read().test(*id)->record.model_toml, record.model_toml);
    EXPECT_EQ(store.read().test(*id)->record.model_file, record.model_file);
}

TEST_F(StoreTest, FrozenSamplesLoseTheirValueAndKeepTheirRegister) {
    auto store = open_store(path);
    const auto id = store.begin_test(test_record(3));
    for (std::int64_t k = 0; k < 10; ++k) {
        ScanRecord scan = scan_record(k, 3);
        if (k == 6) scan.samples[1] = {30000U, no_value, Quality::open};
        ASSERT_OK(store.append_scan(*id, scan));
    }
    const std::size_t channels[] = {1, 2};
    const auto marked = store.mark_stuck(*id, channels, 5, 8);
    ASSERT_OK(marked);
    EXPECT_EQ(*marked, 7);
    const auto scans = store.read().scans(*id);
    EXPECT_EQ((*scans)[5].samples[0].quality, Quality::good);
    EXPECT_EQ((*scans)[5].samples[1].quality, Quality::stuck);
    EXPECT_EQ((*scans)[5].samples[1].raw, 181U);
    EXPECT_EQ((*scans)[6].samples[1].quality, Quality::open) << "a fault code stays what it is";
    EXPECT_EQ((*scans)[9].samples[2].quality, Quality::good);
    EXPECT_THAT(findings_text(*store.read().verify()), IsEmpty());
}

TEST_F(StoreTest, AScanFillsAHoleOnlyWhereItFits) {
    auto store = open_store(path);
    const auto id = store.begin_test(test_record());
    for (const std::int64_t k : {0, 3, 4}) ASSERT_OK(store.append_scan(*id, scan_record(k)));
    ScanRecord wrong = scan_record(2);
    wrong.time_s = 100.0;
    EXPECT_THAT(store.append_scan(*id, wrong).error().message,
                HasSubstr("not before 45.02 of the scan after"));
    const ScanRecord both[] = {scan_record(1), scan_record(2), scan_record(5)};
    ASSERT_OK(store.append_scans(*id, both));
    EXPECT_EQ(store.read().scans(*id)->size(), 6U);
    EXPECT_THAT(findings_text(*store.read().verify()), IsEmpty());
}

TEST_F(StoreTest, TheSameScanAgainIsAcknowledgedAndStoredOnce) {
    auto store = open_store(path);
    const auto id = store.begin_test(test_record());
    ASSERT_OK(store.append_scan(*id, scan_record(0)));
    ASSERT_OK(store.append_scan(*id, scan_record(0)));
    EXPECT_EQ(store.read().scans(*id)->size(), 1U);

    ScanRecord other = scan_record(0);
    other.wall_ns += 1;
    const auto refused = store.append_scan(*id, other);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().next, NextStep::refuse_input);
    EXPECT_THAT(refused.error().message, HasSubstr("stored already"));
}

TEST_F(StoreTest, AScanThatContradictsTheTestIsRefusedWhole) {
    auto store = open_store(path);
    const auto id = store.begin_test(test_record());
    ASSERT_OK(store.append_scan(*id, scan_record(0)));
    const auto refuses = [&](const ScanRecord& scan, const char* why) {
        const auto result = store.append_scan(*id, scan);
        ASSERT_FALSE(result) << why;
        EXPECT_EQ(result.error().next, NextStep::refuse_input);
        EXPECT_THAT(result.error().message, HasSubstr(why));
    };
    refuses(scan_record(1, 15), "15 samples for 16 channels");
    ScanRecord scan = scan_record(1);
    scan.samples[4].value_C = no_value;
    refuses(scan, "good sample without a value");
    scan = scan_record(1);
    scan.time_s = 0.0;
    refuses(scan, "not after");
    scan = scan_record(1);
    scan.inputs = {{"spindle_rpm", 1.0}, {"spindle_rpm", 2.0}};
    refuses(scan, "UNIQUE");
    const std::vector<ScanRecord> batch = {scan_record(1), scan_record(2, 3)};
    ASSERT_FALSE(store.append_scans(*id, batch));
    EXPECT_EQ(store.read().scans(*id)->size(), 1U) << "nothing of a refused call stays";
    ASSERT_OK(store.append_scan(*id, scan_record(1)));
}

TEST_F(StoreTest, OneTestIsOpenAtATime) {
    auto store = open_store(path);
    const auto first = store.begin_test(test_record());
    ASSERT_OK(first);
    const auto second = store.begin_test(test_record());
    ASSERT_FALSE(second);
    EXPECT_THAT(second.error().message, HasSubstr("still running"));
    ASSERT_OK(store.set_state(*first, TestState::aborted, start, "a person stopped it"));
    const auto third = store.begin_test(test_record());
    ASSERT_OK(third);
    EXPECT_NE(*third, *first);
    const auto tests = store.read().tests();
    ASSERT_EQ(tests->size(), 2U);
    EXPECT_EQ(tests->back().stop_reason, "a person stopped it");
    EXPECT_TRUE(tests->back().ended.has_value());
}

TEST_F(StoreTest, StatesFollowTheirOrder) {
    auto store = open_store(path);
    const auto id = store.begin_test(test_record());
    EXPECT_FALSE(store.set_state(*id, TestState::running, start, ""));
    ASSERT_OK(store.set_state(*id, TestState::declared, start, ""));
    EXPECT_FALSE(store.set_state(*id, TestState::running, start, ""));
    ASSERT_OK(store.append_scan(*id, scan_record(0)));
    ASSERT_OK(store.set_state(*id, TestState::stopped, {start.wall_ns + 1, start.monotonic_ns + 1},
                              "all declared"));
    EXPECT_FALSE(store.set_state(*id, TestState::aborted, start, ""));
    const auto late = store.append_scan(*id, scan_record(1));
    ASSERT_FALSE(late);
    EXPECT_THAT(late.error().message, HasSubstr("takes no more scans"));
    EXPECT_FALSE(store.set_state(99, TestState::stopped, start, ""));
}

TEST_F(StoreTest, EndingATestEmptiesTheLog) {
    auto store = open_store(path);
    const auto id = store.begin_test(test_record());
    for (std::int64_t k = 0; k < 20; ++k) ASSERT_OK(store.append_scan(*id, scan_record(k)));
    EXPECT_GT(store.wal_bytes(), 0U);
    ASSERT_OK(store.checkpoint());
    ASSERT_OK(store.set_state(*id, TestState::stopped, start, "done"));
    EXPECT_EQ(store.wal_bytes(), 0U);
}

TEST_F(StoreTest, DeclarationsComeBackBitForBit) {
    auto store = open_store(path);
    const auto id = store.begin_test(test_record());
    ASSERT_OK(store.append_scan(*id, scan_record(0)));
    DeclarationRecord declaration;
    declaration.channel = "T5";
    declaration.window_end_scan = 0;
    declaration.declared_at_min = 62.25;
    declaration.n = 20;
    declaration.C = 64.0;
    declaration.sigma = std::nextafter(4.0, 5.0);
    declaration.steady_state_C = 26.74 + 1e-15;
    declaration.steady_state_low_C = 0.1 + 0.2;
    declaration.rmse_by_n_C = {1.0 / 3.0, no_value, std::nextafter(0.1, 1.0), 5e-324, 1.7976931348623157e308};
    declaration.basis_json = R"({"window_scans": 249})";
    declaration.version = "0.1.0";
    ASSERT_OK(store.record_declaration(*id, declaration));

    const auto back = store.read().declarations(*id);
    ASSERT_OK(back);
    ASSERT_EQ(back->size(), 1U);
    const auto& d = back->front();
    const auto bits = [](double value) { return std::bit_cast<std::uint64_t>(value); };
    EXPECT_EQ(d.channel, "T5");
    EXPECT_EQ(bits(d.sigma), bits(declaration.sigma));
    EXPECT_EQ(bits(d.steady_state_C), bits(declaration.steady_state_C));
    EXPECT_EQ(bits(d.steady_state_low_C), bits(declaration.steady_state_low_C));
    EXPECT_TRUE(std::isnan(d.steady_state_high_C));
    ASSERT_EQ(d.rmse_by_n_C.size(), declaration.rmse_by_n_C.size());
    EXPECT_TRUE(std::isnan(d.rmse_by_n_C[1]));
    for (const std::size_t i : {0U, 2U, 3U, 4U})
        EXPECT_EQ(bits(d.rmse_by_n_C[i]), bits(declaration.rmse_by_n_C[i]));
    EXPECT_EQ(d.basis_json, declaration.basis_json);

    EXPECT_FALSE(store.record_declaration(*id, declaration)) << "a second declaration of one channel";
    declaration.channel = "T17";
    EXPECT_FALSE(store.record_declaration(*id, declaration));
    declaration.channel = "T6";
    declaration.window_end_scan = 1;
    EXPECT_FALSE(store.record_declaration(*id, declaration)) << "on a scan that is not there";
    declaration.window_end_scan = 0;
    declaration.basis_json = "{not json";
    EXPECT_FALSE(store.record_declaration(*id, declaration));
}

TEST_F(StoreTest, TheNewestIdentificationOfEachChannelAndTheirHistory) {
    auto store = open_store(path);
    const auto id = store.begin_test(test_record());
    for (std::int64_t k = 0; k < 3; ++k) ASSERT_OK(store.append_scan(*id, scan_record(k)));
    ASSERT_OK(store.record_identifications(
        *id, std::vector<IdentificationRecord>{{"T5", 0, 1, "{\"n\":1}"}, {"T2", 0, 1, "{\"n\":2}"}}));
    ASSERT_OK(
        store.record_identifications(*id, std::vector<IdentificationRecord>{{"T5", 2, 3, "{\"n\":3}"}}));
    const auto latest = store.read().latest_identifications(*id);
    ASSERT_OK(latest);
    ASSERT_EQ(latest->size(), 2U);
    EXPECT_EQ((*latest)[0].channel, "T2");
    EXPECT_EQ((*latest)[1].channel, "T5");
    EXPECT_EQ((*latest)[1].window_end_scan, 2);
    EXPECT_EQ((*latest)[1].verdict_json, "{\"n\":3}");
    EXPECT_EQ(store.read().identifications(*id, "T5")->size(), 2U);
}

TEST_F(StoreTest, EventsAndTheArchive) {
    auto store = open_store(path);
    const auto id = store.begin_test(test_record());
    EventRecord event;
    event.kind = "daemon_started";
    event.message = "version 0.1.0";
    ASSERT_OK(store.record_event(event));
    event.test_id = *id;
    event.time_s = 61.5;
    event.kind = "annotation";
    event.channel = "T5";
    event.message = "door opened, 18 °C outside";
    const auto second = store.record_event(event);
    ASSERT_OK(second);
    EXPECT_EQ(store.read().events(std::nullopt)->size(), 2U);
    const auto of_test = store.read().events(*id);
    ASSERT_EQ(of_test->size(), 1U);
    EXPECT_EQ(of_test->front().id, *second);
    EXPECT_EQ(of_test->front().message, event.message);
    EXPECT_EQ(of_test->front().time_s, 61.5);
    EXPECT_EQ(of_test->front().channel, "T5");
    EXPECT_THAT(*store.read().events(*id, *second), IsEmpty());
    event.test_id = 77;
    EXPECT_FALSE(store.record_event(event)) << "of a test that is not there";

    ArchiveRecord archive;
    archive.machine = "VMC 850";
    archive.test_id = *id;
    archive.spectrum_json = "{\"time_constants_min\":[4.0,40.0]}";
    ASSERT_OK(store.record_archive(archive));
    archive.machine = "lathe";
    archive.test_id.reset();
    ASSERT_OK(store.record_archive(archive));
    ASSERT_EQ(store.read().archive("VMC 850")->size(), 1U);
    EXPECT_EQ(store.read().archive("VMC 850")->front().spectrum_json, "{\"time_constants_min\":[4.0,40.0]}");
    EXPECT_EQ(store.read().archive("")->size(), 2U);
}

TEST_F(StoreTest, ARestartGoesOnWithTheOpenTest) {
    TestId id = 0;
    {
        auto store = open_store(path);
        EXPECT_FALSE(store.resume()->has_value());
        id = *store.begin_test(test_record());
        for (std::int64_t k = 0; k < 5; ++k) ASSERT_OK(store.append_scan(id, scan_record(k)));
        ASSERT_OK(
            store.record_identifications(id, std::vector<IdentificationRecord>{{"T5", 4, 1, "{\"n\":20}"}}));
    }
    auto store = open_store(path);
    const auto resumed = store.resume();
    ASSERT_OK(resumed);
    ASSERT_TRUE(resumed->has_value());
    EXPECT_EQ((*resumed)->test.id, id);
    EXPECT_EQ((*resumed)->test.state, TestState::running);
    EXPECT_EQ((*resumed)->test.record.channels.size(), 16U);
    EXPECT_EQ((*resumed)->test.record.boot_id, "4a0c");
    EXPECT_EQ((*resumed)->test.last_scan, 4);
    EXPECT_EQ(store.read().scans(id)->size(), 5U);
    EXPECT_EQ((*resumed)->identifications.size(), 1U);
    const std::vector<ScanRecord> gap = {missed_scan(5), missed_scan(6)};
    ASSERT_OK(store.append_scans(id, gap));
    ASSERT_OK(store.append_scan(id, scan_record(7)));
    EXPECT_THAT(findings_text(*store.read().verify()), IsEmpty());
}

TEST_F(StoreTest, TheDatabaseItselfRefusesAWrongNumber) {
    auto store = open_store(path);
    const auto id = store.begin_test(test_record());
    ASSERT_OK(store.append_scan(*id, scan_record(0)));
    Direct direct(path);
    ASSERT_EQ(direct.run("PRAGMA foreign_keys = ON"), SQLITE_OK);
    EXPECT_EQ(direct.run("UPDATE samples SET quality = 'open' WHERE channel = 1"), SQLITE_CONSTRAINT)
        << "a value without good quality";
    EXPECT_EQ(direct.run("UPDATE samples SET value_C = NULL WHERE channel = 1"), SQLITE_CONSTRAINT)
        << "good quality without a value";
    EXPECT_EQ(direct.run("UPDATE samples SET value_C = 9e999 WHERE channel = 1"), SQLITE_CONSTRAINT)
        << "infinity";
    EXPECT_EQ(direct.run("UPDATE samples SET quality = 'fine' WHERE channel = 1"), SQLITE_CONSTRAINT);
    EXPECT_EQ(direct.run("UPDATE samples SET raw = 'abc' WHERE channel = 1"), SQLITE_CONSTRAINT) << "STRICT";
    EXPECT_EQ(direct.run("UPDATE samples SET raw = -1 WHERE channel = 1"), SQLITE_CONSTRAINT);
    EXPECT_EQ(direct.run("UPDATE samples SET channel = 16 WHERE channel = 1"), SQLITE_CONSTRAINT)
        << "foreign key";
    EXPECT_EQ(direct.run("DELETE FROM scans"), SQLITE_CONSTRAINT) << "samples refer to it";
    EXPECT_EQ(direct.run("UPDATE tests SET state = 'stopped'"), SQLITE_CONSTRAINT)
        << "stopped without an end";
}

TEST_F(StoreTest, AReaderSeesWholeScansWhileTheStoreWrites) {
    auto store = open_store(path);
    const auto id = store.begin_test(test_record());
    std::atomic<bool> done = false;
    std::atomic<int> reads = 0;
    std::string trouble;
    std::thread reading([&] {
        auto reader = Reader::open(path);
        if (!reader) trouble = reader.error().message;
        std::size_t before = 0;
        while (reader && trouble.empty() && (!done || reads == 0)) {
            const auto scans = reader->scans(*id);
            if (!scans) {
                trouble = scans.error().message;
                break;
            }
            if (scans->size() < before) trouble = "fewer scans than before";
            before = scans->size();
            for (const auto& scan : *scans)
                if (scan.samples.size() != 16) trouble = "part of a scan";
            ++reads;
        }
    });
    for (std::int64_t k = 0; k < 200; ++k) {
        EXPECT_TRUE(store.append_scan(*id, scan_record(k)));
        EXPECT_TRUE(store.checkpoint());
    }
    done = true;
    reading.join();
    EXPECT_THAT(trouble, IsEmpty());
    EXPECT_GT(reads.load(), 0);
}

TEST_F(StoreTest, AReaderCannotWrite) {
    auto store = open_store(path);
    const auto id = store.begin_test(test_record());
    ASSERT_OK(store.append_scan(*id, scan_record(0)));
    const auto copy = folder / "copy.db";
    {
        auto reader = Reader::open(path);
        ASSERT_OK(reader);
        ASSERT_OK(reader->backup(copy));
        EXPECT_FALSE(reader->backup(copy)) << "would overwrite";
    }
    auto reader = Reader::open(copy);
    ASSERT_OK(reader);
    EXPECT_EQ(reader->scans(*id)->size(), 1U);
    EXPECT_THAT(findings_text(*reader->verify()), IsEmpty());
}

TEST_F(StoreTest, ALockedDatabaseIsRetryAndNothingIsLost) {
    auto store = Store::open(path, start, {.busy_timeout_ms = 50});
    ASSERT_OK(store);
    const auto id = store->begin_test(test_record());
    {
        Direct direct(path);
        ASSERT_EQ(direct.run("BEGIN IMMEDIATE"), SQLITE_OK);
        const auto result = store->append_scan(*id, scan_record(0));
        ASSERT_FALSE(result);
        EXPECT_EQ(result.error().next, NextStep::retry);
        EXPECT_THAT(result.error().message, HasSubstr("holds a lock"));
    }
    ASSERT_OK(store->append_scan(*id, scan_record(0)));
}

TEST_F(StoreTest, AFullDiskIsRetryAndGoesOnWhenThereIsRoom) {
    // The file size limit stands in for the full disk: the write fails in the same call, with the same
    // effect.
    const pid_t child = fork();
    if (child == 0) {
        std::signal(SIGXFSZ, SIG_IGN);
        auto store = Store::open(path, start);
        if (!store) _exit(10);
        const auto id = store->begin_test(test_record());
        rlimit limit{};
        getrlimit(RLIMIT_FSIZE, &limit);
        const auto room = limit.rlim_cur;
        limit.rlim_cur = store->wal_bytes() + 20'000;
        setrlimit(RLIMIT_FSIZE, &limit);
        std::int64_t acknowledged = 0;
        Result<void> result;
        while ((result = store->append_scan(*id, scan_record(acknowledged))) && acknowledged < 100)
            ++acknowledged;
        if (result) _exit(11);
        if (result.error().next != NextStep::retry) _exit(12);
        limit.rlim_cur = room;
        setrlimit(RLIMIT_FSIZE, &limit);
        for (; acknowledged < 40; ++acknowledged)
            if (!store->append_scan(*id, scan_record(acknowledged))) _exit(13);
        if (store->read().scans(*id)->size() != 40) _exit(14);
        _exit(store->read().verify()->empty() ? 0 : 15);
    }
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFEXITED(status));
    EXPECT_EQ(WEXITSTATUS(status), 0);
}

}  // namespace
}  // namespace thermbal::test
