#pragma once

#include <string>
#include <vector>

#include "base/error.hpp"
#include "database.hpp"
#include "store/reader.hpp"

namespace thermbal {

/// One declaration of a test that went on, and what then happened. NaN where a figure is not known.
struct TrackedDeclaration {
    TestId test = 0;
    std::string machine;
    DeclarationRecord declared;
    std::string does_not_count;      ///< why there is no truth to hold it against; empty where there is
    double settles_at_C = no_value;  ///< where the channel settles with the room of the declaration's window
    double error_C = no_value;       ///< declared less that
    double rise_C = no_value;
    bool held = false;   ///< its 90 % interval
    bool wrong = false;  ///< off by more than max(0.3 C, 5 % of the rise)
    /// The first window from which on, at every one up to the declaration, the prediction was within the
    /// tolerance of what then happened and its interval held it: nobody could honestly have declared sooner.
    double earliest_honest_min = no_value;
};

struct TrackRecordOptions {
    DatabaseOptions database;
    double tolerance_C = 0.2;  ///< of "earliest honest"
};

/// Every declaration of every ended test with keep_measuring, oldest first; withdrawn ones are in it.
Result<std::vector<TrackedDeclaration>> track_declarations(const Reader& reader, double tolerance_C);

/// `thermbalctl track-record`. Returns the exit status.
int run_track_record(const TrackRecordOptions& options);

}  // namespace thermbal
