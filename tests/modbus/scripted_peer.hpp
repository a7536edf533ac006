#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "modbus/link.hpp"

namespace thermbal::test {

using Bytes = std::vector<std::uint8_t>;

/// CRC-16/MODBUS, bit by bit from the polynomial, appended low byte first.
Bytes with_crc(Bytes frame);

/// A request as the peer received it, and the frames that answer it.
struct Heard {
    Transport transport = Transport::tcp;
    int number = 0;  ///< 1 for the first request that the peer ever got
    Bytes frame;

    int unit() const;
    int function() const;
    int address() const;
    int count() const;
    Bytes frame_around(const Bytes& pdu) const;  ///< unit, transaction id, length and CRC as they should be
    Bytes right_reply() const;  ///< register r holds number * 1000 + r: a reply tells whose it is
    Bytes exception(int code) const;
};

/// A Modbus peer on a thread of its own, TCP on loopback or RTU on a pseudo-terminal, that does what a script
/// says.
class ScriptedPeer {
  public:
    using Send = std::function<void(const Bytes&)>;
    using Hang_up = std::function<void()>;
    using Script = std::function<void(const Heard&, const Send&, const Hang_up&)>;

    ScriptedPeer(Transport transport, Script script);
    ~ScriptedPeer();
    ScriptedPeer(const ScriptedPeer&) = delete;
    ScriptedPeer& operator=(const ScriptedPeer&) = delete;

    LinkOptions options() const;
    int requests() const { return requests_; }
    int connections() const { return connections_; }
    const std::string& device() const { return device_; }

  private:
    void serve_tcp();
    void serve(int fd);

    Transport transport_;
    Script script_;
    int listener_ = -1;
    int port_ = 0;
    int master_ = -1;
    int slave_ = -1;
    std::string device_;
    std::atomic<int> requests_ = 0;
    std::atomic<int> connections_ = 0;
    std::atomic<bool> stopping_ = false;
    std::thread thread_;
};

}  // namespace thermbal::test
