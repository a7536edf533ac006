#pragma once

#include <string>

#include "database.hpp"
#include "offline.hpp"
#include "report/test_report.hpp"

namespace thermbal {

struct ReportOptions {
    std::string what;          ///< id of a test, or a recording; empty: the newest test
    OfflineOptions recording;  ///< how a recording is run; its threads also for a test
    DatabaseOptions database;  ///< where a test is
    std::string out;           ///< HTML file, or "-"
    bool json = false;
};

/// A test out of the database, as it was declared. Errors: those of Reader.
Result<TestReport> report_of_test(const Reader& reader, TestId id, const ReportOptions& options);

/// A recording, run through the live flow.
Result<TestReport> report_of_recording(const ReportOptions& options);

/// `thermbalctl report`. Returns the exit status.
int run_report(const ReportOptions& options);

}  // namespace thermbal
