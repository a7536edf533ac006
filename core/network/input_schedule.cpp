#include "input_schedule.hpp"

#include <algorithm>
#include <cmath>

namespace thermbal {

InputSchedule::InputSchedule(const Inputs& inputs, std::span<const double> sample_times_s)
    : inputs_(inputs), start_s_(inputs.time_s.empty() ? 0.0 : inputs.time_s.front()) {
    end_s_ = sample_times_s.empty() ? start_s_ : sample_times_s.back();
}

std::optional<std::size_t> InputSchedule::use(std::string_view name) {
    const auto known = std::ranges::find(used_, name, &Held::name);
    if (known != used_.end()) return static_cast<std::size_t>(known - used_.begin());
    const auto column = std::ranges::find(inputs_.columns, name, &Column::name);
    if (column == inputs_.columns.end()) return std::nullopt;
    Held held{.name = column->name, .from_s = {}, .value = {}};
    for (std::size_t row = 0; row < column->values.size(); ++row) {
        const double value = column->values[row];
        if (!std::isfinite(value) || (!held.value.empty() && value == held.value.back())) continue;
        held.from_s.push_back(inputs_.time_s[row]);
        held.value.push_back(value);
    }
    if (held.value.empty()) return std::nullopt;
    used_.push_back(std::move(held));
    return used_.size() - 1;
}

std::vector<double> InputSchedule::jumps_s() const {
    std::vector<double> jumps;
    for (const Held& held : used_) jumps.insert(jumps.end(), held.from_s.begin() + 1, held.from_s.end());
    std::erase_if(jumps, [this](double time_s) { return time_s <= start_s_ || time_s >= end_s_; });
    return jumps;
}

std::vector<double> InputSchedule::seen_switchings_s(std::string_view node) const {
    const auto seen = std::ranges::find(inputs_.seen_switchings, node, &Inputs::SeenSwitchings::node);
    return seen == inputs_.seen_switchings.end() ? std::vector<double>{} : seen->moments_s;
}

double InputSchedule::at(std::size_t column, double time_s) {
    Held& held = used_[column];
    while (held.now + 1 < held.from_s.size() && held.from_s[held.now + 1] <= time_s) ++held.now;
    return held.value[held.now];
}

void InputSchedule::rewind() {
    for (Held& held : used_) held.now = 0;
}

}  // namespace thermbal
