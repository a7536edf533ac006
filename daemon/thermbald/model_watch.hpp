#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "compute/comparison.hpp"
#include "config/config.hpp"
#include "store/records.hpp"

namespace thermbal {

/// The simulation that a test is compared with, as it was given.
struct TestModel {
    std::string file;
    std::string toml;
    std::shared_ptr<const Model> model;
};

/// For a test with the configured channels and these inputs. Error (refuse_input): FILE:LINE:COLUMN, one line
/// a mistake.
Result<TestModel> parse_test_model(std::string toml, std::string file, const Config& config,
                                   std::span<const KnownInput> inputs);
/// The same from the file.
Result<TestModel> read_test_model(const std::string& file, const Config& config,
                                  std::span<const KnownInput> inputs);

/// What the comparison of a test with its model has said so far. One thread, no clock.
class ModelWatch {
  public:
    explicit ModelWatch(TestModel model) : model_(std::move(model)) {}

    const TestModel& model() const { return model_; }

    /// Takes up the channels that disagreed when an earlier daemon ended, from the events of the test.
    void restore(std::span<const EventRecord> events);

    /// Whether the test so far is to be checked as a whole: on multiples of 5 min of its time, from 20 min
    /// on.
    bool check_is_due(double time_s) const;
    /// Of a window that ends at `time_s`.
    ComparisonJob job(std::uint64_t generation, std::int64_t scan, TestWindow window);

    /// One event for a change of state.
    struct Change {
        std::string kind;  ///< model_disagrees, model_agrees, model_failed
        std::optional<std::string> channel;
        std::string message;
    };
    /// `time_s`: of the result's scan.
    std::vector<Change> take(const ComparisonResult& result, double time_s);

    /// Of the newest comparison; null without one. `disagrees`: what the newest check said.
    const ChannelComparison* channel(std::string_view name) const;
    bool disagrees(std::string_view channel) const;

    /// The member `model` of `status`.
    nlohmann::json to_json() const;

  private:
    std::vector<std::string> disagreeing() const;
    std::vector<Change> take_agreement(const std::vector<ChannelAgreement>& agreement, double time_s);
    std::string_view state() const;

    TestModel model_;
    std::vector<ChannelComparison> channels_;
    std::vector<ChannelAgreement> agreement_;
    std::optional<double> compared_s_, checked_s_;
    double asked_to_check_s_ = 0.0;
    double seconds_ = 0.0;
    std::string problem_;  ///< why there is no comparison; empty while there is one
};

}  // namespace thermbal
