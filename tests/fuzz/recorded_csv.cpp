// A recorded test: what is accepted is the same when it is written out and read again, and fits a grid.
#include <cmath>
#include <cstdint>
#include <string>

#include "check.hpp"
#include "series/recorded_test.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace thermbal;
    const auto test = parse_recorded_test({reinterpret_cast<const char*>(data), size}, "fuzz.csv");
    if (!test) {
        FUZZ_CHECK(test.error().next == NextStep::refuse_input && !test.error().message.empty());
        return 0;
    }
    for (std::size_t row = 1; row < test->time_s.size(); ++row) {
        FUZZ_CHECK(test->time_s[row] > test->time_s[row - 1]);
    }
    for (const Column& column : test->channels) FUZZ_CHECK(column.values.size() == test->time_s.size());
    for (const Column& column : test->inputs) FUZZ_CHECK(column.values.size() == test->time_s.size());
    const std::string text = format_recorded_test(*test);
    const auto again = parse_recorded_test(text, "again.csv");
    FUZZ_CHECK(again && format_recorded_test(*again) == text);

    const double period_s = median_step_s(*test);
    const bool reasonable = !test->time_s.empty() && period_s > 0.0 &&
                            (test->time_s.back() - test->time_s.front()) / period_s < 10000.0;
    if (!reasonable) return 0;
    const TestWindow window = to_window(*test, period_s);
    for (const Column& column : window.channels) FUZZ_CHECK(column.values.size() == window.scans);
    return 0;
}
