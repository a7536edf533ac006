#include "series/resolution.hpp"

#include <vector>

#include <gtest/gtest.h>

#include "series/sample.hpp"

namespace thermbal {
namespace {

TEST(Resolution, IsTheSmallestDifferenceOfReadingsThatDiffer) {
    EXPECT_NEAR(smallest_step(std::vector{21.0, 20.7, no_value, 20.7, 21.4, 21.1}), 0.1, 1e-9);
}

TEST(Resolution, OfReadingsThatAreAllEqualIsNotKnown) {
    EXPECT_EQ(smallest_step(std::vector{20.7, no_value, 20.7}), 0.0);
    EXPECT_EQ(smallest_step({}), 0.0);
}

}  // namespace
}  // namespace thermbal
