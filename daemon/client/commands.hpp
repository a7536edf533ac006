#pragma once

#include <CLI/CLI.hpp>

#include "database.hpp"

namespace thermbal {

/// --database and --socket: the database by name, or else by the daemon that answers on the socket.
void add_database_flags(CLI::App& command, DatabaseOptions& options);

// Each adds subcommands to the program; parsing runs what was asked for, and leaves its exit status in
// `status`.

/// status, channels, predictions, curve, samples, events, health, watch, dashboard, start, stop, annotate.
void add_daemon_commands(CLI::App& app, int& status);
/// tests, export, verify, backup, track-record, ports.
void add_database_commands(CLI::App& app, int& status);
/// identify, replay, compare, learn.
void add_offline_commands(CLI::App& app, int& status);
/// report.
void add_report_command(CLI::App& app, int& status);
/// new, demo.
void add_new_command(CLI::App& app, int& status);
void add_demo_command(CLI::App& app, int& status);
/// metrics.
void add_metrics_command(CLI::App& app, int& status);
/// probe.
void add_probe_command(CLI::App& app, int& status);
/// simulate, calibrate, diagnose.
void add_model_commands(CLI::App& app, int& status);

}  // namespace thermbal
