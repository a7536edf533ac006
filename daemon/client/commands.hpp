#pragma once

#include <CLI/CLI.hpp>

namespace thermbal {

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
/// simulate, calibrate.
void add_model_commands(CLI::App& app, int& status);

}  // namespace thermbal
