#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "series/sample.hpp"
#include "series/test_state.hpp"

namespace thermbal {

using TestId = std::int64_t;

/// A moment on both clocks, read by the caller. `wall_ns` since 1970 UTC; `monotonic_ns` of the clock the
/// daemon's grid runs on, meaningful only together with the boot id.
struct Moment {
    std::int64_t wall_ns = 0;
    std::int64_t monotonic_ns = 0;
};

struct ChannelRecord {
    std::string name;  ///< T1 ... T16, unique in the test
    std::string role;  ///< as configured: "ambient", "machine", ...
    std::string place;
    bool required = true;
    std::string source;            ///< where it is read, for a person: "unit 1, input 5"
    std::string calibration = {};  ///< what was made of the reading, for a person; empty: nothing
};

/// What is known when a test begins. The order of `channels` is the order of ScanRecord::samples.
struct TestRecord {
    std::string name;
    std::string machine;
    std::string config_toml;  ///< the whole effective configuration
    std::string version;      ///< of the program
    double period_s = 15.0;
    bool keep_measuring = false;
    Moment started;
    std::string boot_id;
    std::vector<ChannelRecord> channels;
    std::string model_toml = {};  ///< the simulation model that the test is compared with; empty: none
    std::string model_file = {};  ///< where it came from, for a person
};

struct StoredTest {
    TestId id = 0;
    TestRecord record;
    TestState state = TestState::running;
    std::optional<Moment> ended;
    std::string stop_reason;
    std::optional<std::int64_t> last_scan;  ///< index on the grid; empty before the first scan

    bool open() const { return is_measuring(state); }
};

struct InputValue {
    std::string name;  ///< "spindle_rpm", ...
    double value = no_value;
};

/// One scan of the grid. `scan` counts from 0 at the start of the test, and rises. The *_ns times are on the
/// monotonic clock of TestRecord::started; a missed scan was neither started nor finished.
struct ScanRecord {
    std::int64_t scan = 0;
    ScanStatus status = ScanStatus::ok;
    double time_s = 0.0;  ///< since the start of the test
    std::int64_t scheduled_ns = 0;
    std::optional<std::int64_t> started_ns;
    std::optional<std::int64_t> finished_ns;
    std::int64_t wall_ns = 0;
    std::vector<Sample>
        samples;  ///< one a channel; may be empty for a missed scan: all channels are then `gap`
    std::vector<InputValue> inputs;
};

/// A channel's declaration with all it was based on. NaN means "none". `basis_json` holds whatever else the
/// verdict was computed from; `rmse_by_n_C[i]` belongs to n = i + 1.
struct DeclarationRecord {
    std::string channel;
    std::int64_t window_end_scan = 0;  ///< the newest scan the declaration has seen
    double declared_at_min = no_value;
    int n = 0;
    double C = no_value;
    double sigma = no_value;
    double steady_state_C = no_value;
    double steady_state_low_C = no_value;
    double steady_state_high_C = no_value;
    double equilibrium_time_min = no_value;
    std::vector<double> rmse_by_n_C;
    std::string basis_json = "{}";
    std::string version;
    std::string withdrawn;  ///< why it does not stand any more; empty while it stands
};

/// What one identification said of one channel on the window that ends at `window_end_scan`.
struct IdentificationRecord {
    std::string channel;
    std::int64_t window_end_scan = 0;
    std::int64_t wall_ns = 0;
    std::string verdict_json = "{}";
};

/// An event, or a person's annotation (kind "annotation").
struct EventRecord {
    std::int64_t id = 0;  ///< given by the store
    std::optional<TestId> test_id;
    std::int64_t wall_ns = 0;
    std::optional<double> time_s;  ///< since the start of the test
    std::string kind;
    std::optional<std::string> channel;
    std::string message;
};

/// What a finished test taught about a machine: the prior of the next one.
struct ArchiveRecord {
    std::int64_t id = 0;  ///< given by the store
    std::string machine;
    std::optional<TestId> test_id;  ///< empty when it was learnt elsewhere
    std::int64_t created_wall_ns = 0;
    std::string spectrum_json = "{}";
};

/// One thing `verify` found wrong: where, and what.
struct Finding {
    std::string where;
    std::string what;
};

}  // namespace thermbal
