#pragma once

#include <chrono>
#include <optional>
#include <string_view>

namespace thermbal {

/// What systemd is told (sd_notify(3)); without systemd every call does nothing.
/// READY=1 belongs after configuration, database and socket, not after the module's first answer.
void notify_ready(std::string_view status);
void notify_status(std::string_view status);
void notify_watchdog();
void notify_stopping(std::string_view status);

/// How often the watchdog wants to hear: half of WatchdogSec; empty when there is none.
std::optional<std::chrono::microseconds> watchdog_interval();

}  // namespace thermbal
