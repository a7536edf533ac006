#pragma once

#include "base/parallel.hpp"
#include "declaration/live_flow.hpp"
#include "report/test_report.hpp"

namespace thermbal {

/// Fills report.time_s (the window's scans, then times on to where the slowest channel is in balance) and,
/// of every channel with a verdict, the courses that the verdict's own window leads to. A course that does
/// not end in the verdict's steady state is left out, and `no_course` says so: what is drawn is what was
/// declared.
void add_courses(TestReport& report, const FlowOptions& flow, const ParallelFor& parallel_for);

}  // namespace thermbal
