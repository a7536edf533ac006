#pragma once

#include <optional>
#include <string>

#include <nlohmann/json.hpp>

namespace thermbal {

// What a daemon answers is read with these: a member that is not there, or of another kind than expected, is
// "none", never an exception. A daemon may be older or newer than this client.

std::optional<double> number(const nlohmann::json& object, const char* key);
/// Empty when there is none.
std::string text(const nlohmann::json& object, const char* key);
bool flag(const nlohmann::json& object, const char* key);
/// An empty array when there is none.
const nlohmann::json& list(const nlohmann::json& object, const char* key);
/// An empty object when there is none.
const nlohmann::json& object_in(const nlohmann::json& object, const char* key);

/// With a fixed number of digits; "-" for none.
std::string fixed(std::optional<double> value, int digits);
/// With its sign: "+8.7".
std::string with_sign(std::optional<double> value, int digits);
/// "63 min", from 1000 min on "20.6 h".
std::string minutes(std::optional<double> value);
/// 1234567 -> "1.2 MB".
std::string bytes(std::optional<double> value);

}  // namespace thermbal
