#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include <sys/types.h>

#include "base/error.hpp"
#include "endpoint.hpp"
#include "modbus/frame.hpp"
#include "modbus/link.hpp"
#include "port_lock.hpp"

namespace thermbal {

/// One open line: libmodbus for RTU framing, CRC, the serial settings and the reading of a reply of the
/// length that its own header announces; the rest is here because libmodbus 3.1.6 does it wrong or not at all
/// (see README.md). Decides nothing: what an error means for the line is the link's business.
class Wire {
  public:
    explicit Wire(LinkOptions options);
    ~Wire();
    Wire(const Wire&) = delete;
    Wire& operator=(const Wire&) = delete;

    Result<void> open();
    void close();
    bool is_open() const;

    /// The serial device is still the one that was opened: a USB adapter that was pulled leaves a dead
    /// descriptor.
    bool device_is_same() const;

    Result<void> send(const Request& request);

    /// The checked reply to the request that was sent last. timed_out() tells a silence from a bad frame.
    Result<std::vector<std::uint16_t>> receive(const Request& request);
    bool timed_out() const { return timed_out_; }

    /// Bytes arrive within `wait_s`, or the other side has closed.
    bool readable(double wait_s) const;

    /// Bytes are there now; the end of a connection is none.
    bool has_bytes() const;

    /// Reads away what is there now; empty when the other side has closed the line.
    std::optional<std::size_t> discard();

  private:
    struct Context;
    Result<void> open_serial();
    Result<void> open_socket();
    Result<void> make_context(const char* device);
    Result<void> check_descriptor();

    LinkOptions options_;
    std::unique_ptr<Context> context_;
    Resolver resolver_;
    PortLock lock_;
    std::string device_;
    dev_t device_number_ = 0;
    ino_t device_inode_ = 0;
    std::uint16_t transaction_id_;
    bool timed_out_ = false;
};

}  // namespace thermbal
