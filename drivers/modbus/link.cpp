#include "modbus/link.hpp"

#include <algorithm>
#include <chrono>
#include <map>
#include <random>
#include <set>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "base/backoff.hpp"
#include "modbus/frame.hpp"
#include "modbus/profile.hpp"
#include "wire.hpp"

namespace thermbal {
namespace {

using Registers = std::vector<std::uint16_t>;

MonotonicClock::duration seconds(double s) {
    return std::chrono::duration_cast<MonotonicClock::duration>(std::chrono::duration<double>(s));
}

double seconds_until(Deadline deadline) {
    return std::chrono::duration<double>(deadline - MonotonicClock::now()).count();
}

/// RTU keeps a silence of 3.5 characters of 11 bits between frames (Modbus over serial line V1.02, 2.5.1.1).
LinkOptions with_line_silence(LinkOptions options) {
    if (options.transport == Transport::rtu)
        options.quiet_s = std::max(options.quiet_s, 3.5 * 11.0 / options.baud);
    return options;
}

bool is_read(const Request& request) {
    return request.function == 3 || request.function == 4;
}

/// How many registers the probe before a read of `count` asks for: never as many, and not as many as the
/// probes before it, whose own replies may be under way. Even numbers first, which are whole values of 16 as
/// of 32 bits: there are modules that do not answer to half a value.
int probe_length(int count, int earlier_probes) {
    if (count <= 2) return earlier_probes % 2 == 0 ? 3 - count : 3;
    const int even_lengths = (count - 1) / 2;
    const int turn = earlier_probes % (count - 1);
    return turn < even_lengths ? 2 * (turn + 1) : 2 * (turn - even_lengths) + 1;
}

/// The link's state machine: closed -> (pausing after a failed opening) -> open, and on an open RTU line
/// clean -> in doubt -> (drained, probed)
/// -> clean. TCP knows no doubt: the connection is closed, and the transaction id of the next one goes on
/// counting.
class ModbusLink final : public Link {
  public:
    explicit ModbusLink(LinkOptions options)
        : options_(with_line_silence(std::move(options))),
          wire_(options_),
          backoff_(options_.first_pause_s, options_.longest_pause_s, std::random_device{}()) {}

    Result<Registers> read_block(int unit_id, int function, int first, int count) override {
        if (function != 3 && function != 4) return refuse(fmt::format("function {}; 3 or 4", function));
        if (count < 1 || count > max_registers_per_read) {
            return refuse(fmt::format("{} registers in one read; 1 to {}", count, max_registers_per_read));
        }
        if (first < 0 || first + count > 65536)
            return refuse(fmt::format("registers from {}; 0 to 65535", first));
        return call({.unit_id = unit_id, .function = function, .address = first, .count_or_value = count});
    }

    Result<void> write_coil(int unit_id, int address, bool value) override {
        return write(
            {.unit_id = unit_id, .function = 5, .address = address, .count_or_value = value ? 0xFF00 : 0});
    }

    Result<void> write_register(int unit_id, int address, std::uint16_t value) override {
        return write({.unit_id = unit_id, .function = 6, .address = address, .count_or_value = value});
    }

    void close() override {
        wire_.close();
        units_in_doubt_.clear();
    }

    LinkCounters counters() const override { return counters_; }

  private:
    bool rtu_framing() const { return options_.transport != Transport::tcp; }

    std::unexpected<Error> refuse(const std::string& what) const {
        return fail(NextStep::refuse_input, fmt::format("line {}: {}", options_.name, what));
    }

    Result<void> write(const Request& request) {
        if (request.address < 0 || request.address > 65535) {
            return refuse(fmt::format("address {}; 0 to 65535", request.address));
        }
        auto done = call(request);
        if (!done) return std::unexpected(done.error());
        return {};
    }

    Result<Registers> call(const Request& request) {
        // 0 is the broadcast, which nobody answers; 248 and above are reserved on a serial line, 255 is used
        // over TCP.
        const int last_unit = options_.transport == Transport::tcp ? 255 : 247;
        const int first_unit = options_.transport == Transport::tcp ? 0 : 1;
        if (request.unit_id < first_unit || request.unit_id > last_unit) {
            return refuse(fmt::format("unit id {}; {} to {}", request.unit_id, first_unit, last_unit));
        }
        Result<Registers> result = ready_exchange(request);
        if (!result) {
            result.error().message = fmt::format("line {}: {}", options_.name, result.error().message);
        }
        return result;
    }

    Result<Registers> ready_exchange(const Request& request) {
        if (auto open = prepare(); !open) return std::unexpected(std::move(open.error()));
        if (rtu_framing()) {
            if (auto settled = settle(request); !settled) return std::unexpected(std::move(settled.error()));
        }
        return exchange(request);
    }

    /// An open line to the device that is plugged in now.
    Result<void> prepare() {
        if (wire_.is_open() && (!wire_.device_is_same() || spoiled_while_idle())) wire_.close();
        if (wire_.is_open()) return {};
        return MonotonicClock::now() < pause_until_ ? still_pausing() : open();
    }

    Result<void> open() {
        auto opened = wire_.open();
        last_byte_ = MonotonicClock::now();
        if (opened) {
            ++counters_.connects;
            backoff_.succeeded();
            return opened;
        }
        ++counters_.connect_failures;
        pause_until_ = last_byte_ + seconds(backoff_.failed_s());
        why_pausing_ = opened.error().message;
        return opened;
    }

    Result<void> still_pausing() {
        ++counters_.pauses;
        return fail(NextStep::reopen_link, why_pausing_);
    }

    /// A line that the other side has closed since the last reply, or a TCP connection with a reply that
    /// nobody waits for any more: a new connection costs less than a lost scan.
    bool spoiled_while_idle() {
        if (!wire_.readable(0.0)) return false;
        return !discard_stray() || !rtu_framing();
    }

    /// RTU has no transaction id: whatever is still under way has to be out of the way before the next
    /// request.
    Result<void> settle(const Request& request) {
        if (auto silent = wait_for_silence(); !silent) return silent;
        if (!units_in_doubt_.contains(request.unit_id) || !is_read(request)) return {};
        return probe(request);
    }

    Result<void> wait_for_silence() {
        const Deadline give_up =
            MonotonicClock::now() + seconds(2.0 * options_.response_timeout_s + 2.0 * options_.quiet_s);
        for (;;) {
            const Deadline silent_at = std::max(quiet_until_, last_byte_ + seconds(options_.quiet_s));
            if (!wire_.readable(std::max(0.0, seconds_until(std::min(silent_at, give_up))))) {
                if (MonotonicClock::now() >= silent_at) return {};
            } else if (!discard_stray()) {
                wire_.close();
                return fail(NextStep::reopen_link, "the line was closed by the other side");
            }
            if (MonotonicClock::now() >= give_up) {
                return fail(NextStep::reopen_link,
                            "the line does not fall silent: something sends without being asked");
            }
        }
    }

    /// A reply to an earlier request may come after any silence. It can be told from the reply to a request
    /// for another number of registers, and a unit answers in order: once it has answered such a probe,
    /// nothing older is under way. An exception is an answer, too.
    Result<void> probe(const Request& request) {
        Request other = request;
        other.count_or_value = probe_length(request.count_or_value, probes_[request.unit_id]++);
        other.address = std::min(other.address, 65536 - other.count_or_value);
        const auto answer = exchange(other);
        if (!answer && answer.error().next != NextStep::retry) return std::unexpected(answer.error());
        units_in_doubt_.erase(request.unit_id);
        return {};
    }

    Result<Registers> exchange(const Request& request) {
        ++counters_.requests;
        last_unit_ = request.unit_id;
        auto sent = wire_.send(request);
        if (!sent) return in_doubt(request, std::move(sent.error()));
        auto reply = wire_.receive(request);
        last_byte_ = MonotonicClock::now();
        if (!reply && reply.error().next != NextStep::retry) {
            ++(wire_.timed_out() ? counters_.timeouts : counters_.bad_frames);
            return in_doubt(request, std::move(reply.error()));
        }
        // TCP: what completes a truncated reply is the head of another frame, whose rest is there at once.
        if (rtu_framing() ? wire_.readable(options_.quiet_s) : wire_.has_bytes()) {
            ++counters_.bad_frames;
            return in_doubt(request,
                            {.next = NextStep::reopen_link,
                             .message = fmt::format("unit {}: more bytes behind the reply than it has: which "
                                                    "of them are the reply cannot be known",
                                                    request.unit_id)});
        }
        ++(reply ? counters_.replies : counters_.exceptions);
        return reply;
    }

    std::unexpected<Error> in_doubt(const Request& request, Error error) {
        quiet_until_ = MonotonicClock::now() + seconds(options_.response_timeout_s);
        if (rtu_framing()) units_in_doubt_.insert(request.unit_id);
        if (options_.transport != Transport::rtu || !wire_.device_is_same() || !wire_.discard())
            wire_.close();
        return std::unexpected(std::move(error));
    }

    bool discard_stray() {
        const auto discarded = wire_.discard();
        if (!discarded) return false;
        counters_.stray_bytes += *discarded;
        last_byte_ = MonotonicClock::now();
        if (*discarded > 0 && last_unit_ > 0) units_in_doubt_.insert(last_unit_);
        return true;
    }

    const LinkOptions options_;
    Wire wire_;
    LinkCounters counters_;
    std::set<int> units_in_doubt_;  ///< RTU framing: an old reply of these may still come
    std::map<int, int> probes_;     ///< sent to each unit
    int last_unit_ = 0;
    Deadline quiet_until_{};  ///< not before this moment is a request sent after a doubt
    Deadline last_byte_{};
    Backoff backoff_;
    Deadline pause_until_{};   ///< no opening before this moment, after one that failed
    std::string why_pausing_;  ///< what that opening said
};

}  // namespace

std::unique_ptr<Link> make_link(LinkOptions options) {
    return std::make_unique<ModbusLink>(std::move(options));
}

}  // namespace thermbal
