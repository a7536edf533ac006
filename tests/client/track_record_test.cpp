// thermbalctl track-record on a database whose declarations and whose ends are known beforehand.
#include <cmath>
#include <filesystem>
#include <random>

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

constexpr std::int64_t wall_ns = 1'700'000'000'000'000'000;
constexpr std::int64_t scan_ns = 60'000'000'000;
constexpr std::int64_t last_scan = 300;  // one a minute

/// A channel that goes from 18 C by one exponential to where it settles.
struct Curve {
    std::string channel;
    double settles_C;
    double time_constant_min;
};
const std::vector<Curve> curves = {
    {"T2", 26.0, 30.0}, {"T3", 22.0, 25.0}, {"T4", 30.0, 400.0}, {"T5", 24.0, 30.0}};

class TrackRecord : public ::testing::Test {
  protected:
    void SetUp() override {
        std::string name = (std::filesystem::temp_directory_path() / "thermbal-track-XXXXXX").string();
        folder = mkdtemp(name.data());
        path = folder / "thermbal.db";
        auto store = Store::open(path, {wall_ns, 1}).value();
        const TestId kept = measured_test(store, true);
        declare(store, kept, {"T2", 26.1, 25.95, 26.25, 90});
        declare(store, kept, {"T3", 22.5, 22.4, 22.6, 60});
        declare(store, kept, {"T4", 29.0, 28.9, 29.1, 120});
        declare(store, kept, {"T5", 24.0, 23.9, 24.1, 290});
        store.withdraw_declaration(kept, "T3", "later samples exclude it").value();
        // T2 at 30 min far off; at 50 right; at 70 right, and its interval elsewhere; right from 80 on.
        identify(store, kept, {"T2", 24.0, 23.0, 25.0, 30});
        identify(store, kept, {"T2", 25.9, 25.5, 26.3, 50});
        identify(store, kept, {"T2", 26.15, 26.05, 26.25, 70});
        identify(store, kept, {"T2", 26.05, 25.8, 26.3, 80});
        identify(store, kept, {"T2", 26.1, 25.95, 26.25, 90});
        end(store, kept);
        const TestId stopped = measured_test(store, false);
        declare(store, stopped, {"T2", 26.0, 25.9, 26.1, 90});
        end(store, stopped);
        const TestId running = measured_test(store, true);
        declare(store, running, {"T2", 26.0, 25.9, 26.1, 90});
    }
    void TearDown() override { std::filesystem::remove_all(folder); }

    struct Claim {
        std::string channel;
        double steady_state_C;
        double low_C;
        double high_C;
        std::int64_t scan;
    };

    static TestId measured_test(Store& store, bool keep_measuring) {
        TestRecord record;
        record.name = "warm-up";
        record.machine = "VMC-3";
        record.version = "0.1.0";
        record.period_s = 60.0;
        record.keep_measuring = keep_measuring;
        record.started = {wall_ns, 0};
        record.boot_id = "b";
        record.channels.push_back({"T1", "ambient", "room", true, ""});
        for (const Curve& curve : curves)
            record.channels.push_back({curve.channel, "structure", "somewhere", true, ""});
        const TestId id = store.begin_test(record).value();
        std::mt19937_64 generator(5);
        std::normal_distribution<double> noise(0.0, 0.02);
        std::vector<ScanRecord> scans;
        for (std::int64_t scan = 0; scan <= last_scan; ++scan) {
            ScanRecord row;
            row.scan = scan;
            row.time_s = 60.0 * static_cast<double>(scan);
            row.scheduled_ns = scan * scan_ns;
            row.started_ns = row.scheduled_ns;
            row.finished_ns = row.scheduled_ns + 1;
            row.wall_ns = wall_ns + row.scheduled_ns;
            row.samples = {{180, 18.0, Quality::good}};
            for (const Curve& curve : curves) {
                const double way = -std::expm1(-static_cast<double>(scan) / curve.time_constant_min);
                row.samples.push_back(
                    {1, 18.0 + (curve.settles_C - 18.0) * way + noise(generator), Quality::good});
            }
            scans.push_back(std::move(row));
        }
        store.append_scans(id, scans).value();
        return id;
    }

    static void end(Store& store, TestId id) {
        store.set_state(id, TestState::aborted, {wall_ns + 301 * scan_ns, 301 * scan_ns}, "by hand").value();
    }

    static void declare(Store& store, TestId id, const Claim& claim) {
        DeclarationRecord declaration;
        declaration.channel = claim.channel;
        declaration.window_end_scan = claim.scan;
        declaration.declared_at_min = static_cast<double>(claim.scan);
        declaration.n = 12;
        declaration.steady_state_C = claim.steady_state_C;
        declaration.steady_state_low_C = claim.low_C;
        declaration.steady_state_high_C = claim.high_C;
        declaration.version = "0.1.0";
        store.record_declaration(id, declaration).value();
    }

    static void identify(Store& store, TestId id, const Claim& claim) {
        const json verdict = {{"channel", claim.channel},
                              {"state", "measuring"},
                              {"n", 12},
                              {"rmse_by_n_C", json::array()},
                              {"steady_state_C", claim.steady_state_C},
                              {"steady_state_low_C", claim.low_C},
                              {"steady_state_high_C", claim.high_C},
                              {"svr", {{"n", 12}}},
                              {"guards", json::array()},
                              {"reason", ""}};
        const std::vector<IdentificationRecord> records = {
            {claim.channel, claim.scan, wall_ns, verdict.dump()}};
        store.record_identifications(id, records).value();
    }

    json document() const {
        const Output output = run(fmt::format("track-record --json --database {}", path.string()));
        EXPECT_EQ(output.status, 0) << output.text;
        return json::parse(output.text);
    }

    static json row_of(const json& document, const std::string& channel) {
        for (const json& row : document["declarations"]) {
            if (row["channel"] == channel) return row;
        }
        return nullptr;
    }

    std::filesystem::path folder;
    std::filesystem::path path;
};

TEST_F(TrackRecord, HoldsADeclarationAgainstWhatThenHappened) {
    const json found = document();
    EXPECT_EQ(found["declarations"].size(), 4U) << "only the ended test that went on";
    const json right = row_of(found, "T2");
    EXPECT_NEAR(right["settles_at_C"].get<double>(), 26.0, 0.01);
    EXPECT_NEAR(right["error_C"].get<double>(), 0.1, 0.01);
    EXPECT_NEAR(right["rise_C"].get<double>(), 8.0, 0.2);
    EXPECT_EQ(right["held"], true);
    EXPECT_EQ(right["wrong"], false);
    EXPECT_EQ(right["earliest_honest_min"], 80.0);
    const json wrong = row_of(found, "T3");
    EXPECT_NEAR(wrong["error_C"].get<double>(), 0.5, 0.01);
    EXPECT_EQ(wrong["held"], false);
    EXPECT_EQ(wrong["wrong"], true);
    EXPECT_EQ(wrong["withdrawn"], "later samples exclude it");
    EXPECT_TRUE(wrong["earliest_honest_min"].is_null());
}

TEST_F(TrackRecord, SaysWhatDoesNotCountAndWhy) {
    const json found = document();
    EXPECT_THAT(row_of(found, "T4")["does_not_count"].get<std::string>(), HasSubstr("has not settled"));
    EXPECT_THAT(row_of(found, "T5")["does_not_count"].get<std::string>(), HasSubstr("ended 10 min later"));
    EXPECT_TRUE(row_of(found, "T4")["error_C"].is_null());
}

TEST_F(TrackRecord, SumsUp) {
    const json sum = document()["summary"];
    EXPECT_EQ(sum["declarations"], 4);
    EXPECT_EQ(sum["counted"], 2);
    EXPECT_EQ(sum["wrong"], 1);
    EXPECT_NEAR(sum["bias_C"].get<double>(), 0.3, 0.01);
    EXPECT_NEAR(sum["rms_error_C"].get<double>(), std::sqrt((0.01 + 0.25) / 2.0), 0.01);
    EXPECT_EQ(sum["held"], 1);
    EXPECT_NEAR(sum["held_share_low"].get<double>(), 0.0945, 1e-4);  // statsmodels, method "wilson"
    EXPECT_NEAR(sum["held_share_high"].get<double>(), 0.9055, 1e-4);
    EXPECT_NEAR(sum["median_declared_at_min"].get<double>(), 75.0, 1e-9);
}

TEST_F(TrackRecord, IsReadByAPerson) {
    const Output output = run(fmt::format("track-record --database {}", path.string()));
    EXPECT_EQ(output.status, 0);
    EXPECT_THAT(output.text,
                HasSubstr("4 declarations, 2 count; 1 off by more than max(0.3 C, 5 % of the rise)"));
    EXPECT_THAT(output.text, HasSubstr("wrong; withdrawn: later samples exclude it"));
}

}  // namespace
}  // namespace thermbal::test
