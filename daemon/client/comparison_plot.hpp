#pragma once

#include <string>

#include <nlohmann/json.hpp>

namespace thermbal {

/// `compare`'s document as a drawing: a panel a channel, error in C against the window's end in min, one line
/// an estimator with its 90 % interval as a band, the tolerance shaded, the information limit dashed.
std::string comparison_svg(const nlohmann::json& document);

/// The same as a page that needs nothing else: the drawing under what it shows.
std::string comparison_page(const nlohmann::json& document);

}  // namespace thermbal
