#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace thermbal {

inline constexpr char default_socket[] = "/run/thermbal/thermbald.sock";

/// What every command that asks a running daemon has.
struct AskOptions {
    std::string socket = default_socket;
    bool json = false;
};

// The commands. Each asks once, prints the answer and returns the exit status.

int run_status(const AskOptions& ask);
int run_channels(const AskOptions& ask);
int run_predictions(const AskOptions& ask);
int run_health(const AskOptions& ask);

struct StartOptions {
    std::string name;  ///< empty, as the rest: as configured
    std::string machine;
    std::string model;                ///< file of the simulation that the test is compared with
    std::vector<std::string> inputs;  ///< "spindle_rpm=5000"
};
int run_start(const AskOptions& ask, const StartOptions& options);
/// Known inputs have other values from the next scan on: "spindle_rpm=3000".
int run_inputs(const AskOptions& ask, const std::vector<std::string>& inputs);
int run_stop(const AskOptions& ask, const std::string& reason, bool abort);
int run_annotate(const AskOptions& ask, const std::string& message, const std::string& channel);

struct SamplesOptions {
    std::string channel;  ///< empty: all
    std::optional<std::int64_t> from_scan;
    std::int64_t limit = 2000;
};
int run_samples(const AskOptions& ask, const SamplesOptions& options);

/// Of every channel with an empty name.
int run_curve(const AskOptions& ask, const std::string& channel);

struct EventsOptions {
    std::int64_t after_id = 0;
    std::int64_t limit = 200;
    bool follow = false;  ///< goes on until interrupted or the daemon ends; JSON is then one document a line
};
int run_events(const AskOptions& ask, const EventsOptions& options);

}  // namespace thermbal
