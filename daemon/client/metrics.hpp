#pragma once

#include <string>

#include <nlohmann/json.hpp>

namespace thermbal {

/// A daemon's own answers to `status`, `channels` and `health`, as they came.
struct DaemonAnswers {
    nlohmann::json status;
    nlohmann::json channels;
    nlohmann::json health;
};

/// As Prometheus' text format 0.0.4: base units, `thermbal_` in front. What is not known has no sample; a
/// channel whose reading is not good has no temperature, and a quality that says why. A pure function; any
/// shape of JSON is taken.
std::string prometheus_text(const DaemonAnswers& answers);

/// What is said when no daemon answers: thermbal_up 0, and nothing else.
std::string prometheus_text_of_nobody();

}  // namespace thermbal
