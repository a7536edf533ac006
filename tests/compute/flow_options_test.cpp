#include "compute/flow_options.hpp"

#include <gtest/gtest.h>

#include "config/load.hpp"

namespace thermbal {
namespace {

TEST(FlowOptionsOfAStoredTest, AreThoseOfItsConfiguration) {
    const FlowOptions flow =
        flow_options(stored_identification("[identification]\ntolerance_C = 0.25\nmax_lag = 12\nsweep_always "
                                           "= false\n[[line]]\nname = \"a\"\n"));
    EXPECT_EQ(flow.tolerance_C, 0.25);
    EXPECT_EQ(flow.sweep.last_lag, 12U);
    EXPECT_EQ(flow.sweep_when, SweepWhen::needed);
}

TEST(FlowOptionsOfAStoredTest, AreTheDefaultsWhereItSaysNothingThatIsAccepted) {
    for (const char* toml : {"", "not = [toml", "[identification]\nmax_lag = 1000\ntolerance_C = \"wide\"\n",
                             "identification = 3\n"}) {
        const FlowOptions flow = flow_options(stored_identification(toml));
        EXPECT_EQ(flow.tolerance_C, 0.2) << toml;
        EXPECT_EQ(flow.sweep.last_lag, 35U) << toml;
        EXPECT_EQ(flow.sweep_when, SweepWhen::always) << toml;
    }
}

}  // namespace
}  // namespace thermbal
