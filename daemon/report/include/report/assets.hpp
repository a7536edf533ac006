#pragma once

#include <string_view>

namespace thermbal {

// What the report and the dashboard are made of, compiled into the program.

std::string_view dygraphs_js();  ///< the library as Debian ships it
std::string_view dygraphs_css();
std::string_view dygraphs_version();  ///< "dygraphs 2.2.1"
std::string_view plots_js();          ///< assets/plots.js: draws figures with dygraphs
std::string_view page_css();          ///< assets/page.css: both colour schemes, phone, paper

std::string_view dashboard_html();
std::string_view dashboard_js();

}  // namespace thermbal
