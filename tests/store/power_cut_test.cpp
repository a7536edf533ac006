// What is left when the power goes: at any operation of the disk, with any part of what was not synced yet.
#include <algorithm>
#include <cstdlib>

#include <gmock/gmock.h>

#include "store/store.hpp"
#include "support.hpp"
#include "watched_vfs.hpp"

namespace thermbal::test {
namespace {

constexpr std::int64_t scans = 60;

/// Opens a new database, begins a test, appends scans with a checkpoint now and then: all that it does to the
/// disk.
std::vector<FileOperation> record_of_a_test() {
    const Folder folder(memory_folder());
    install_watched_vfs();
    start_record();
    {
        auto store = open_store(folder / "thermbal.db");
        const auto id = store.begin_test(test_record());
        EXPECT_TRUE(id);
        for (std::int64_t scan = 0; scan < scans; ++scan) {
            EXPECT_TRUE(store.append_scan(*id, scan_record(scan)));
            record_acknowledge(scan);
            if (scan % 7 == 0) {
                EXPECT_TRUE(store.checkpoint());
            }
            if (scan % 20 == 19) {
                EventRecord note;
                note.test_id = *id;
                note.kind = "note";
                EXPECT_TRUE(store.record_event(note));
            }
        }
        EXPECT_TRUE(store.set_state(*id, TestState::declared, start, "declared"));
    }
    return take_record();
}

/// Empty when the acknowledged scans are there, once each, as they were.
std::string trouble_after(const PowerCut& cut, std::mt19937& random) {
    const Folder folder(memory_folder());
    const auto path = folder / "thermbal.db";
    cut.write_to(path.parent_path(), random);
    auto store = Store::open(path, start);
    if (!store) return store.error().message;
    // While the file is being made there is nothing to lose yet.
    if (store->set_aside()) return cut.acknowledged() < 0 ? "" : "set aside as damaged";
    if (const auto findings = store->read().verify(); !findings || !findings->empty())
        return findings ? findings_text(*findings) : findings.error().message;
    const auto test = store->read().open_test();
    if (!test) return test.error().message;
    if (!*test) return cut.acknowledged() < 0 ? "" : "the test is gone";
    const auto stored = store->read().scans((*test)->id);
    if (!stored) return stored.error().message;
    if (static_cast<std::int64_t>(stored->size()) <= cut.acknowledged())
        return fmt::format("{} scans, {} were acknowledged", stored->size(), cut.acknowledged() + 1);
    for (std::size_t k = 0; k < stored->size(); ++k)
        for (std::size_t i = 0; i < 16; ++i)
            if ((*stored)[k].samples[i].value_C != value_C(static_cast<std::int64_t>(k), i))
                return fmt::format("scan {} holds another value", k);
    if (const auto more = store->append_scan((*test)->id, scan_record(scans)); !more)
        return more.error().message;
    return {};
}

int cuts_wanted() {
    const char* const wanted = std::getenv("THERMBAL_POWER_CUTS");  // NOLINT(concurrency-mt-unsafe)
    return wanted == nullptr ? 400 : std::atoi(wanted);
}

TEST(PowerCutTest, NoAcknowledgedScanIsLost) {
    const auto record = record_of_a_test();
    ASSERT_GT(record.size(), 500U);
    const auto seed = std::random_device{}();
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    std::uniform_int_distribution<std::size_t> at(0, record.size());
    std::size_t inside_a_commit = 0;
    for (int round = 0; round < cuts_wanted(); ++round) {
        const std::size_t operations = at(random);
        inside_a_commit +=
            operations > 0 && record[operations - 1].kind == FileOperation::Kind::write ? 1U : 0U;
        const PowerCut cut(record, operations, {});
        ASSERT_EQ(trouble_after(cut, random), "")
            << "cut after operation " << operations << " of " << record.size();
    }
    EXPECT_GT(inside_a_commit, 100U);
    RecordProperty("operations", static_cast<int>(record.size()));
    RecordProperty("cuts_inside_a_commit", static_cast<int>(inside_a_commit));
}

/// The control: on a disk that ignores syncs, the same cuts do lose scans. Otherwise the test above would
/// prove nothing.
TEST(PowerCutTest, ADiskThatLiesLosesThem) {
    const auto record = record_of_a_test();
    std::mt19937 random(1);
    std::uniform_int_distribution<std::size_t> at(record.size() / 2, record.size());
    int troubled = 0;
    for (int round = 0; round < 20; ++round) {
        troubled +=
            trouble_after(PowerCut(record, at(random), {.syncs_count = false}), random).empty() ? 0 : 1;
    }
    EXPECT_GT(troubled, 15);
}

}  // namespace
}  // namespace thermbal::test
