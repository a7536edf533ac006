#include <algorithm>
#include <cmath>

#include "network/simulate.hpp"

namespace thermbal {

Inputs inputs_of(const RecordedTest& test, double within_s) {
    Inputs inputs{.time_s = test.time_s, .columns = test.inputs, .first_readings = {}};
    inputs.columns.insert(inputs.columns.end(), test.channels.begin(), test.channels.end());
    for (const Column& channel : test.channels) {
        const auto first = std::ranges::find_if(channel.values, [](double v) { return std::isfinite(v); });
        if (first == channel.values.end()) continue;
        const auto row = static_cast<std::size_t>(first - channel.values.begin());
        if (test.time_s[row] > test.time_s.front() + within_s) continue;
        inputs.first_readings.push_back({channel.name, *first});
    }
    return inputs;
}

}  // namespace thermbal
