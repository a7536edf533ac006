#include "report/verdict_json.hpp"

#include <cmath>

#include "series/sample.hpp"

namespace thermbal {
namespace {

double number_from(const nlohmann::json& json, const char* key) {
    const auto found = json.find(key);
    return found == json.end() || !found->is_number() ? no_value : found->get<double>();
}

ChannelState state_from(const std::string& name) {
    for (const ChannelState state :
         {ChannelState::declared, ChannelState::barely_warming, ChannelState::stuck, ChannelState::dead}) {
        if (to_string(state) == name) return state;
    }
    return ChannelState::measuring;
}

}  // namespace

nlohmann::json number_or_null(double value) {
    return std::isfinite(value) ? nlohmann::json(value) : nlohmann::json(nullptr);
}

nlohmann::json guard_to_json(const Guard& guard) {
    return {{"name", guard.name}, {"passed", guard.passed}, {"figures", guard.figures}};
}

nlohmann::json verdict_to_json(const ChannelVerdict& verdict) {
    nlohmann::json curve = nlohmann::json::array();
    for (const double rmse_C : verdict.rmse_by_n_C) curve.push_back(number_or_null(rmse_C));
    nlohmann::json guards = nlohmann::json::array();
    for (const Guard& guard : verdict.guards) guards.push_back(guard_to_json(guard));
    return {{"channel", verdict.channel},
            {"state", to_string(verdict.state)},
            {"declared", verdict.declared()},
            {"declared_at_min", number_or_null(verdict.declared_at_min)},
            {"stands_since_min", number_or_null(verdict.stands_since_min)},
            {"window_end_min", number_or_null(verdict.window_end_min)},
            {"n", verdict.n},
            {"window_rmse_C", number_or_null(verdict.window_rmse_C)},
            {"rmse_by_n_C", std::move(curve)},
            {"value_C", number_or_null(verdict.value_C)},
            {"steady_state_C", number_or_null(verdict.steady_state_C)},
            {"steady_state_low_C", number_or_null(verdict.steady_state_low_C)},
            {"steady_state_high_C", number_or_null(verdict.steady_state_high_C)},
            {"tolerance_C", number_or_null(verdict.tolerance_C)},
            {"room_C", number_or_null(verdict.room_C)},
            {"equilibrium_time_min", number_or_null(verdict.equilibrium_time_min)},
            {"equilibrium_time_low_min", number_or_null(verdict.equilibrium_time_low_min)},
            {"equilibrium_time_high_min", number_or_null(verdict.equilibrium_time_high_min)},
            {"svr",
             {{"n", verdict.svr.n},
              {"steady_state_C", number_or_null(verdict.svr.steady_state_C)},
              {"equilibrium_time_min", number_or_null(verdict.svr.equilibrium_time_min)},
              {"C", number_or_null(verdict.svr.C)},
              {"sigma", number_or_null(verdict.svr.sigma)}}},
            {"kalman",
             {{"steady_state_C", number_or_null(verdict.kalman.steady_state_C)},
              {"steady_state_low_C", number_or_null(verdict.kalman.steady_state_low_C)},
              {"steady_state_high_C", number_or_null(verdict.kalman.steady_state_high_C)},
              {"equilibrium_time_min", number_or_null(verdict.kalman.equilibrium_time_min)}}},
            {"guards", std::move(guards)},
            {"reason", verdict.reason}};
}

Result<ChannelVerdict> verdict_from_json(const nlohmann::json& json) {
    try {
        ChannelVerdict verdict;
        verdict.channel = json.at("channel").get<std::string>();
        verdict.state = state_from(json.at("state").get<std::string>());
        verdict.declared_at_min = number_from(json, "declared_at_min");
        verdict.stands_since_min = number_from(json, "stands_since_min");
        if (std::isnan(verdict.stands_since_min)) verdict.stands_since_min = verdict.declared_at_min;
        verdict.window_end_min = number_from(json, "window_end_min");
        verdict.n = json.at("n").get<int>();
        verdict.window_rmse_C = number_from(json, "window_rmse_C");
        for (const nlohmann::json& value : json.at("rmse_by_n_C")) {
            verdict.rmse_by_n_C.push_back(value.is_number() ? value.get<double>() : no_value);
        }
        verdict.value_C = number_from(json, "value_C");
        verdict.steady_state_C = number_from(json, "steady_state_C");
        verdict.steady_state_low_C = number_from(json, "steady_state_low_C");
        verdict.steady_state_high_C = number_from(json, "steady_state_high_C");
        verdict.tolerance_C = number_from(json, "tolerance_C");
        verdict.room_C = number_from(json, "room_C");
        verdict.equilibrium_time_min = number_from(json, "equilibrium_time_min");
        verdict.equilibrium_time_low_min = number_from(json, "equilibrium_time_low_min");
        verdict.equilibrium_time_high_min = number_from(json, "equilibrium_time_high_min");
        const nlohmann::json& svr = json.at("svr");
        verdict.svr = {svr.at("n").get<int>(), number_from(svr, "steady_state_C"),
                       number_from(svr, "equilibrium_time_min"), number_from(svr, "C"),
                       number_from(svr, "sigma")};
        if (const auto kalman = json.find("kalman");
            kalman != json.end()) {  // stored by an older version: none
            verdict.kalman = {
                number_from(*kalman, "steady_state_C"), number_from(*kalman, "steady_state_low_C"),
                number_from(*kalman, "steady_state_high_C"), number_from(*kalman, "equilibrium_time_min")};
        }
        for (const nlohmann::json& guard : json.at("guards")) {
            verdict.guards.push_back({guard.at("name").get<std::string>(), guard.at("passed").get<bool>(),
                                      guard.at("figures").get<std::string>()});
        }
        verdict.reason = json.at("reason").get<std::string>();
        return verdict;
    } catch (const nlohmann::json::exception& error) {
        return fail(NextStep::stop, std::string("a stored verdict cannot be read: ") + error.what());
    }
}

}  // namespace thermbal
