#pragma once

#include <string>

#include "report/page.hpp"
#include "report/test_report.hpp"

namespace thermbal {

// The parts of a report from top to bottom, each as HTML. Those with plots take the page that holds the
// tables.

std::string verdict_section(const TestReport& report, const TestAnswer& answer);
std::string channel_table(const TestReport& report);
std::string overview_section(const TestReport& report, Page& page);
std::string sensor_map(const TestReport& report);
std::string channel_section(const TestReport& report, const ReportChannel& channel, Page& page);
std::string quality_section(const TestReport& report);
std::string events_section(const TestReport& report);
std::string provenance_section(const TestReport& report);

// Figures as a person reads them; "-" for what is not known.

std::string degrees(double value_C, int digits = 2);
/// "243 min", from 10 h on "12.4 h".
std::string duration(double minutes);
/// Samples of each quality that occurs, good first.
std::vector<std::pair<Quality, std::size_t>> quality_counts(const ReportChannel& channel);
/// "measuring", "declared", ...; "ambient" for the room, "-" without a verdict.
std::string state_of(const ReportChannel& channel);

}  // namespace thermbal
