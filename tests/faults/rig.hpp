#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "modbus/link.hpp"
#include "modbus/unit.hpp"
#include "simulator/server.hpp"
#include "simulator/sim_clock.hpp"
#include "simulator/station.hpp"

namespace thermbal::soak {

inline constexpr std::size_t most_channels = 16;

/// So many units on one line, ids from 1 on, which share the simulator's 16 channels evenly.
struct Layout {
    std::size_t units = 2;

    std::size_t inputs_per_unit() const { return most_channels / units; }
    std::size_t channels() const { return units * inputs_per_unit(); }
};

/// The register of a channel at a scan: another one at every scan and on every channel, never a fault code. A
/// word of another scan, channel or unit is seen as such.
std::int16_t plant_word(std::uint64_t seed, std::int64_t scan, std::size_t channel);

/// thermbal-sim's own server and station on a thread, over TCP on loopback or RTU on a pseudo-terminal,
/// measuring plant_word at the scan that it is told. All members from any thread.
class Rig {
  public:
    Rig(Transport transport, Layout layout, std::uint64_t seed);
    ~Rig();
    Rig(const Rig&) = delete;
    Rig& operator=(const Rig&) = delete;

    const Layout& layout() const { return layout_; }
    /// Where it is to be found, with this response timeout.
    LinkOptions link_options(double response_timeout_s) const;

    void begin_scan(std::int64_t scan) { scan_ = scan; }
    void begin_fault(const Fault& fault);
    void end_faults();
    std::uint64_t faults_begun() const { return faults_begun_; }
    /// No fault is planned, the endpoint is as it should be, and the last byte that a fault has spoilt or
    /// held back has gone out.
    bool quiet() const { return monotonic_ns() > disturbed_until_ns_; }

    /// How long at most the host kept the module's thread, which wakes every millisecond, from running since
    /// reset_stall(); one that is not over yet included.
    double worst_stall_s() const;
    void reset_stall() { worst_pause_ns_ = 0; }

  private:
    void serve(int stop_fd);
    EndpointState look(std::int64_t now_ns);
    std::vector<Delivery> answer(Framing framing, const ModbusRequest& request, std::int64_t now_ns);
    std::vector<double> measured_C() const;

    const Transport transport_;
    const Layout layout_;
    const std::uint64_t seed_;
    std::atomic<std::int64_t> scan_ = 0;
    std::atomic<std::uint64_t> faults_begun_ = 0;
    std::atomic<std::int64_t> disturbed_until_ns_ = 0;
    std::atomic<std::int64_t> looked_ns_;
    std::atomic<std::int64_t> worst_pause_ns_ = 0;  ///< between two looks
    mutable std::mutex mutex_;
    Station station_;                 // guarded by mutex_
    std::mt19937_64 turnaround_;      // server thread
    std::int64_t busy_until_ns_ = 0;  // server thread: when the newest request is answered
    EndpointState seen_;              // server thread: at the look before
    std::unique_ptr<Server> server_;
    int port_ = 0;
    std::string folder_;
    UniqueFd stop_;
    std::thread thread_;
};

}  // namespace thermbal::soak
