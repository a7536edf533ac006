#include "rows.hpp"

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace thermbal {
namespace {

std::vector<double> curve_in(const std::string& text) {
    std::vector<double> curve;
    const auto json = nlohmann::json::parse(text, nullptr, false);
    if (!json.is_array()) return curve;
    for (const auto& value : json) curve.push_back(value.is_number() ? value.get<double>() : no_value);
    return curve;
}

}  // namespace

EventRecord event_in(const sqlite::Statement& row) {
    EventRecord event;
    event.id = row.integer(0);
    event.test_id = row.optional_integer(1);
    event.wall_ns = row.integer(2);
    if (!row.null(3)) event.time_s = row.real(3);
    event.kind = row.text(4);
    if (!row.null(5)) event.channel = row.text(5);
    event.message = row.text(6);
    return event;
}

DeclarationRecord declaration_in(const sqlite::Statement& row) {
    DeclarationRecord declaration;
    declaration.channel = row.text(0);
    declaration.window_end_scan = row.integer(1);
    declaration.declared_at_min = row.real(2);
    declaration.n = static_cast<int>(row.integer(3));
    declaration.C = row.real(4);
    declaration.sigma = row.real(5);
    declaration.steady_state_C = row.real(6);
    declaration.steady_state_low_C = row.real(7);
    declaration.steady_state_high_C = row.real(8);
    declaration.equilibrium_time_min = row.real(9);
    declaration.rmse_by_n_C = curve_in(row.text(10));
    declaration.basis_json = row.text(11);
    declaration.version = row.text(12);
    declaration.withdrawn = row.text(13);
    return declaration;
}

}  // namespace thermbal
