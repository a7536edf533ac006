#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "base/error.hpp"
#include "series/recorded_test.hpp"

namespace thermbal {

/// A recorded test as a source of scans: what its channels read at any time. Nothing is interpolated: a time
/// gets the row that was the newest then.
class RecordedScans {
  public:
    /// Reads a CSV file in the form of INTERFACES. Errors (refuse_input) name the file, line and column.
    static Result<RecordedScans> load(const std::string& path);
    /// Errors (refuse_input): a recording without rows or without channels.
    static Result<RecordedScans> from(RecordedTest test, const std::string& name);

    /// One value a channel of the recording, in its order, C; NaN where that row has no sample. A time before
    /// the first row gets the first row, one after the last row the last.
    std::vector<double> at(double time_s) const;

  private:
    explicit RecordedScans(RecordedTest test) : test_(std::move(test)) {}

    RecordedTest test_;
};

}  // namespace thermbal
