#pragma once

#include <cstdint>
#include <optional>
#include <string>

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

int run_start(const AskOptions& ask, const std::string& name, const std::string& machine);
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
