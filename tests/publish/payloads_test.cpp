#include "publish/payloads.hpp"

#include <gmock/gmock.h>

#include "publish/backlog.hpp"

namespace thermbal {
namespace {

StoredTest two_channels() {
    StoredTest test;
    test.id = 7;
    test.record.name = "5000 idle";
    test.record.machine = "VMC";
    test.record.started.wall_ns = 1'700'000'000'250'000'000;
    test.record.channels = {{"T1", "ambient", "room", false, "", ""},
                            {"T2", "structure", "sleeve", true, "", ""}};
    return test;
}

TEST(Payloads, TimesAreUtcWithMilliseconds) {
    EXPECT_EQ(utc_time(0), "1970-01-01T00:00:00.000Z");
    EXPECT_EQ(utc_time(1'700'000'000'250'999'999), "2023-11-14T22:13:20.250Z");
    EXPECT_EQ(utc_time(-1), "1969-12-31T23:59:59.999Z");
}

TEST(Payloads, AReadingThatIsNotGoodHasNoValue) {
    ScanRecord scan;
    scan.scan = 3;
    scan.samples = {{180, 18.25, Quality::good}, {0x7fff, no_value, Quality::open}};
    scan.inputs = {{"spindle_rpm", no_value}};
    const auto payload = samples_payload("db", two_channels(), scan, false);
    EXPECT_EQ(payload["samples"]["T1"],
              nlohmann::json({{"value_C", 18.25}, {"quality", "good"}, {"raw", 180}}));
    EXPECT_EQ(payload["samples"]["T2"],
              nlohmann::json({{"value_C", nullptr}, {"quality", "open"}, {"raw", 0x7fff}}));
    EXPECT_TRUE(payload["inputs"]["spindle_rpm"].is_null());
}

TEST(Payloads, AMissedScanIsGapsAndNotNothing) {
    ScanRecord scan;
    scan.status = ScanStatus::missed;
    const auto payload = samples_payload("db", two_channels(), scan, true);
    EXPECT_EQ(payload["status"], "missed");
    EXPECT_EQ(payload["revised"], true);
    EXPECT_EQ(payload["samples"]["T2"],
              nlohmann::json({{"value_C", nullptr}, {"quality", "gap"}, {"raw", nullptr}}));
}

TEST(Payloads, OnlyADeclarationThatStandsIsInTheTest) {
    DeclarationRecord withdrawn;
    withdrawn.channel = "T2";
    withdrawn.steady_state_C = 26.0;
    withdrawn.withdrawn = "the spindle stopped";
    auto payload = test_payload("db", two_channels(), {withdrawn});
    EXPECT_TRUE(payload["channels"][1]["declaration"].is_null());
    DeclarationRecord standing;
    standing.channel = "T2";
    standing.steady_state_C = 26.5;
    payload = test_payload("db", two_channels(), {withdrawn, standing});
    EXPECT_EQ(payload["channels"][1]["declaration"]["steady_state_C"], 26.5);
    EXPECT_TRUE(payload["channels"][1]["declaration"]["steady_state_low_C"].is_null());
    EXPECT_EQ(declaration_payload("db", two_channels(), withdrawn)["withdrawn"], "the spindle stopped");
    EXPECT_TRUE(declaration_payload("db", two_channels(), standing)["withdrawn"].is_null());
}

TEST(Payloads, BytesThatAreNoTextDoNotThrow) {
    EXPECT_NE(payload_text({{"message", "\xff\xfe"}}).find("message"), std::string::npos);
}

}  // namespace
}  // namespace thermbal
