#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "base/error.hpp"

namespace thermbal {

enum class Transport : std::uint8_t { tcp, rtu, rtu_over_tcp };

struct LinkOptions {
    std::string name;  ///< the line's name, for messages
    Transport transport = Transport::tcp;

    std::string host = "127.0.0.1";  ///< tcp, rtu_over_tcp: numeric IPv4 or IPv6 address, or a name
    int port = 502;

    std::string device;  ///< rtu: path of the port; used when find_device is empty
    /// rtu: asked for the path at every opening, so that an adapter may come back under another name.
    std::function<Result<std::string>()> find_device;
    int baud = 9600;
    char parity = 'N';  ///< 'N', 'E', 'O'
    int data_bits = 8;
    int stop_bits = 1;

    double response_timeout_s =
        0.5;  ///< from the request to the last byte of the reply: the module's worst reply time
    double connect_timeout_s = 1.0;  ///< name resolution and connection together
    double quiet_s = 0.02;           ///< rtu: silence asked for before a request and after a reply

    /// rtu framing: the reads of a unit are followed by a short one of another length, and count only when
    /// that is what is answered next (modbus/unit.hpp). Over TCP the transaction id says as much.
    bool confirm_reads = true;
    bool confirms_reads() const { return confirm_reads && transport != Transport::tcp; }

    /// After an opening that failed, calls fail at once for a while: doubling from the first to the longest
    /// pause, with jitter. Shorter than the time between two scans, or the first one after a fault is lost.
    double first_pause_s = 0.1;
    double longest_pause_s = 2.0;
};

/// The baud rates that a line may have; any other is refused (libmodbus would silently use 9600).
const std::vector<int>& known_baud_rates();

/// One sentence that names field, value and bound; empty when a link can be made of these.
std::string check_link_options(const LinkOptions& options);

/// No call on a link takes longer than this, whatever the other side does: opening, draining, a probe after a
/// doubt, the exchange itself.
double longest_call_s(const LinkOptions& options);

/// Counted since the link was made; they never go down.
struct LinkCounters {
    std::uint64_t requests = 0;
    std::uint64_t replies = 0;     ///< exchanges that gave what was asked for
    std::uint64_t exceptions = 0;  ///< answered with a Modbus exception
    std::uint64_t timeouts = 0;
    std::uint64_t bad_frames = 0;   ///< CRC, length, transaction id, unit, function, protocol
    std::uint64_t stray_bytes = 0;  ///< read away because nobody had asked for them
    std::uint64_t connects = 0;     ///< openings that succeeded
    std::uint64_t connect_failures = 0;
    std::uint64_t pauses = 0;  ///< calls that failed at once, after an opening that failed
};

/// A Modbus line to one or more units. Opens itself at the first call and again after a failure. One thread
/// at a time.
///
/// Errors of every verb: `retry`: the unit answered with an exception, the line is sound. `reopen_link`:
/// nothing of the exchange is used; the link has closed or will drain by itself before the next request.
/// `refuse_input`: the arguments are outside what Modbus allows, nothing was sent.
class Link {
  public:
    virtual ~Link() = default;

    /// `count` registers (1..125) from `first` on, by function 3 or 4. All of them from one reply, or an
    /// error.
    virtual Result<std::vector<std::uint16_t>> read_block(int unit_id, int function, int first,
                                                          int count) = 0;

    /// Function 5 and 6. An error `reopen_link` means: it is not known whether the unit has done it.
    virtual Result<void> write_coil(int unit_id, int address, bool value) = 0;
    virtual Result<void> write_register(int unit_id, int address, std::uint16_t value) = 0;

    virtual void close() = 0;
    virtual LinkCounters counters() const = 0;
};

/// A link on libmodbus for any transport; nothing is opened yet. Requires
/// check_link_options(options).empty().
std::unique_ptr<Link> make_link(LinkOptions options);

}  // namespace thermbal
