#include "stall_meter.hpp"

#include <algorithm>
#include <chrono>
#include <stdexcept>

#include <poll.h>
#include <unistd.h>

namespace thermbal::soak {
namespace {

constexpr double nap_s = 0.002;

double now_s() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace

StallMeter::StallMeter() : since_s_(now_s()) {
    auto opened = open_pty();
    if (!opened) throw std::runtime_error(opened.error().message);
    port_ = std::move(*opened);
    thread_ = std::jthread([this](const std::stop_token& stop) { measure(stop); });
}

double StallMeter::worst_s() const {
    return std::max(worst_s_.load(), now_s() - since_s_ - nap_s);
}

void StallMeter::ping() const {
    char byte = 'x';
    if (write(port_.master.get(), &byte, 1) != 1) return;
    pollfd arrival{.fd = port_.slave.get(), .events = POLLIN, .revents = 0};
    if (poll(&arrival, 1, 5000) > 0 && read(port_.slave.get(), &byte, 1) != 1) return;
}

void StallMeter::measure(const std::stop_token& stop) {
    while (!stop.stop_requested()) {
        since_s_ = now_s();
        std::this_thread::sleep_for(std::chrono::duration<double>(nap_s));
        ping();
        worst_s_ = std::max(worst_s_.load(), now_s() - since_s_ - nap_s);
    }
}

}  // namespace thermbal::soak
