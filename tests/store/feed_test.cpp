#include "store/feed.hpp"

#include <gmock/gmock.h>

#include "support.hpp"

namespace thermbal::test {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

class FeedTest : public ::testing::Test {
  protected:
    Folder folder{memory_folder()};
    std::filesystem::path path = folder / "thermbal.db";
    Store store = open_store(path);
    TestId test = *store.begin_test(test_record(2));
    Feed feed = open_feed();

    Feed open_feed() const {
        auto opened = Feed::open(path);
        if (!opened) throw std::runtime_error(opened.error().message);
        return std::move(*opened);
    }
    FeedPosition beginning() const { return {feed.database_id(), 0, -1, 0, 0, 0}; }
    static std::vector<std::int64_t> numbers(const std::vector<FeedRow<ScanRecord>>& rows) {
        std::vector<std::int64_t> list;
        for (const auto& row : rows) list.push_back(row.record.scan);
        return list;
    }
};

TEST_F(FeedTest, ScansComeInOrderInPiecesAndOverTests) {
    for (std::int64_t k = 0; k < 5; ++k) ASSERT_OK(store.append_scan(test, scan_record(k, 2)));
    ASSERT_OK(store.set_state(test, TestState::stopped, start, "enough"));
    const TestId second = *store.begin_test(test_record(2));
    for (std::int64_t k = 0; k < 2; ++k) ASSERT_OK(store.append_scan(second, scan_record(k, 2)));

    auto rows = *feed.scans_after(beginning(), 3);
    EXPECT_THAT(numbers(rows), ElementsAre(0, 1, 2));
    rows = *feed.scans_after(rows.back().position, 3);
    EXPECT_THAT(numbers(rows), ElementsAre(3, 4, 0));
    EXPECT_EQ(rows.back().test_id, second);
    EXPECT_EQ(rows.back().record.samples[1].value_C, value_C(0, 1));
    rows = *feed.scans_after(rows.back().position, 3);
    EXPECT_THAT(numbers(rows), ElementsAre(1));
    EXPECT_THAT(*feed.scans_after(rows.back().position, 3), IsEmpty());
    EXPECT_THAT(*feed.revisions_after(beginning(), 10), IsEmpty());
    EXPECT_EQ(feed.before_newest_test()->test_id, second);
    EXPECT_THAT(numbers(*feed.scans_after(*feed.before_newest_test(), 10)), ElementsAre(0, 1));
}

TEST_F(FeedTest, WhatChangesBehindThePositionComesAsARevision) {
    for (const std::int64_t k : {0, 1, 3, 4}) ASSERT_OK(store.append_scan(test, scan_record(k, 2)));
    ASSERT_OK(store.append_scan(test, scan_record(2, 2)));
    auto rows = *feed.revisions_after(beginning(), 10);
    EXPECT_THAT(numbers(rows), ElementsAre(2));
    const std::vector<std::size_t> both = {0, 1};
    ASSERT_EQ(store.mark_stuck(test, both, 1, 2), 4);
    rows = *feed.revisions_after(rows.back().position, 10);
    EXPECT_THAT(numbers(rows), ::testing::UnorderedElementsAre(1, 2));
    EXPECT_EQ(rows.front().record.samples[0].quality, Quality::stuck);
    EXPECT_THAT(*feed.revisions_after(rows.back().position, 10), IsEmpty());
    EXPECT_THAT(findings_text(*store.read().verify()), IsEmpty());
}

TEST_F(FeedTest, ADeclarationComesWhenItIsMadeAndWhenItIsWithdrawn) {
    ASSERT_OK(store.append_scan(test, scan_record(0, 2)));
    DeclarationRecord declaration;
    declaration.channel = "T2";
    declaration.declared_at_min = 1.0;
    declaration.steady_state_C = 26.5;
    ASSERT_OK(store.record_declaration(test, declaration));
    auto rows = *feed.declarations_after(beginning(), 10);
    ASSERT_EQ(rows.size(), 1U);
    EXPECT_EQ(rows[0].record.channel, "T2");
    EXPECT_EQ(rows[0].test_id, test);
    ASSERT_OK(store.withdraw_declaration(test, "T2", "the door opened"));
    rows = *feed.declarations_after(rows.back().position, 10);
    ASSERT_EQ(rows.size(), 1U);
    EXPECT_EQ(rows[0].record.withdrawn, "the door opened");
    EXPECT_THAT(*feed.declarations_after(rows.back().position, 10), IsEmpty());
}

TEST_F(FeedTest, EventsComeOldestFirst) {
    for (const char* kind : {"one", "two", "three"})
        ASSERT_OK(store.record_event({.test_id = std::nullopt,
                                      .time_s = std::nullopt,
                                      .kind = kind,
                                      .channel = std::nullopt,
                                      .message = "m"}));
    const auto rows = *feed.events_after(beginning(), 2);
    ASSERT_EQ(rows.size(), 2U);
    EXPECT_EQ(rows[0].record.kind, "one");
    EXPECT_EQ(feed.events_after(rows.back().position, 10)->front().record.kind, "three");
}

TEST_F(FeedTest, TheVersionChangesWithEveryCommitAndTheIdentityNever) {
    const auto before = *feed.version();
    EXPECT_EQ(*feed.version(), before);
    ASSERT_OK(store.append_scan(test, scan_record(0, 2)));
    EXPECT_NE(*feed.version(), before);
    EXPECT_EQ(feed.database_id().size(), 32U);
    EXPECT_EQ(open_feed().database_id(), feed.database_id());
    const auto other = open_store(folder / "other.db");
    EXPECT_NE(Feed::open(folder / "other.db")->database_id(), feed.database_id());
}

}  // namespace
}  // namespace thermbal::test
