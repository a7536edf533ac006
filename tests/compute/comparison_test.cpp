#include "compute/comparison.hpp"

#include <memory>

#include <gtest/gtest.h>

namespace thermbal {
namespace {

/// An hour of a bearing that stays as warm as its room.
ComparisonJob job_with_check() {
    Model model;
    model.name = "bearing";
    model.ambient.value_C = 20.0;
    model.nodes = {{"bearing", {3000.0, 0.2}}};
    model.links = {{"bearing", "ambient", {4.0, 0.2}}};
    model.sensors = {{"T1", "bearing", 0.05}};
    ComparisonJob job;
    job.model = std::make_shared<const Model>(std::move(model));
    job.window = {0.0, 15.0, 240, {{"T1", std::vector<double>(240, 20.0)}}, {}};
    job.check = true;
    return job;
}

TEST(Comparison, ACheckEndsWhenItIsCancelled) {
    const ComparisonResult whole = compare(job_with_check());
    ASSERT_TRUE(whole.agreement);
    EXPECT_TRUE(*whole.agreement);
    const ComparisonResult cancelled = compare(job_with_check(), [] { return true; });
    ASSERT_TRUE(cancelled.agreement);
    ASSERT_FALSE(*cancelled.agreement);
    EXPECT_EQ(cancelled.agreement->error().next, NextStep::stop);
}

}  // namespace
}  // namespace thermbal
