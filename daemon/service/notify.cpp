#include "service/notify.hpp"

#include <string>

#include <fmt/format.h>
#include <systemd/sd-daemon.h>

namespace thermbal {

namespace {

/// A status is one line: a newline in it would begin another assignment.
std::string one_line(std::string_view text) {
    std::string line(text);
    for (char& c : line)
        if (c == '\n' || c == '\r') c = ' ';
    return line;
}

void tell(const std::string& state) {
    (void)sd_notify(0, state.c_str());
}

}  // namespace

void notify_ready(std::string_view status) {
    tell(fmt::format("READY=1\nSTATUS={}", one_line(status)));
}
void notify_status(std::string_view status) {
    tell(fmt::format("STATUS={}", one_line(status)));
}
void notify_watchdog() {
    tell("WATCHDOG=1");
}
void notify_stopping(std::string_view status) {
    tell(fmt::format("STOPPING=1\nSTATUS={}", one_line(status)));
}

std::optional<std::chrono::microseconds> watchdog_interval() {
    std::uint64_t timeout_us = 0;
    if (sd_watchdog_enabled(0, &timeout_us) <= 0) return std::nullopt;
    return std::chrono::microseconds(timeout_us / 2);
}

}  // namespace thermbal
