#pragma once

#include <cstddef>
#include <string>

#include <nlohmann/json.hpp>

namespace thermbal {

// What the daemon answers to a method, for a person. Each takes the method's JSON result and ends with a
// newline.

std::string status_text(const nlohmann::json& status);
std::string channels_text(const nlohmann::json& channels);
std::string samples_text(const nlohmann::json& samples);
std::string curve_text(const nlohmann::json& curves, std::size_t width, bool unicode);
std::string predictions_text(const nlohmann::json& predictions);
std::string events_text(const nlohmann::json& events);
std::string health_text(const nlohmann::json& health);

/// "12.25 min", or the time of day of what belongs to no test.
std::string event_time(const nlohmann::json& event);
/// "declared: T5 settles at ...": printable, without a newline. Of `events` or of a notification.
std::string event_message(const nlohmann::json& event);

/// "measuring", "no rise", ...: short, as a person reads it. Without a verdict: "ambient" or "-".
std::string state_name(const nlohmann::json& channel);
/// The value where it is good, else the quality: "open". In the short form at most 7 characters.
std::string value_or_quality(const nlohmann::json& sample, bool is_short);

}  // namespace thermbal
