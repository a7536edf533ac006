#pragma once

#include <string>

#include <nlohmann/json.hpp>

namespace thermbal {

/// Of `compare`'s document: over the channels that settled, by window and estimator, how many answers, median
/// and worst absolute error in C, share of 90 % intervals that held; and the information limit's median.
nlohmann::json comparison_summary(const nlohmann::json& document);

/// `compare`'s document for a person: what the end is, the summary, and with `by_channel` every prediction.
std::string comparison_text(const nlohmann::json& document, bool by_channel);

}  // namespace thermbal
