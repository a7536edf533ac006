// Replies as pure bytes: whatever is taken for an answer has to be one, byte by byte.
#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "check.hpp"
#include "modbus/frame.hpp"
#include "modbus/profile.hpp"

namespace {

using namespace thermbal;
using Bytes = std::span<const std::uint8_t>;

/// What the standard says of a reply to a read, written down once more.
void check_registers(const Request& request, Bytes pdu, const std::vector<std::uint16_t>& registers) {
    if (request.function == 5 || request.function == 6) {
        FUZZ_CHECK(registers.empty() && std::ranges::equal(pdu, request_pdu(request)));
        return;
    }
    const auto count = static_cast<std::size_t>(request.count_or_value);
    FUZZ_CHECK(registers.size() == count && pdu.size() == 2 + 2 * count);
    FUZZ_CHECK(pdu[0] == request.function && pdu[1] == 2 * count);
    for (std::size_t i = 0; i < count; ++i) {
        FUZZ_CHECK(registers[i] == pdu[2 + 2 * i] * 256 + pdu[3 + 2 * i]);
    }
}

void check_samples(const std::vector<std::uint16_t>& registers, int choice) {
    ModuleProfile profile;
    profile.type = static_cast<RegisterType>(choice % 5);
    profile.byte_order = static_cast<ByteOrder>(choice / 5 % 4);
    profile.faults = {{.first = 32767, .last = 32767, .quality = Quality::open}};
    for (std::size_t at = 0; at < registers.size(); ++at) {
        const Sample sample = decode(profile, std::span(registers).subspan(at));
        FUZZ_CHECK((sample.quality == Quality::good) == std::isfinite(sample.value_C));
        FUZZ_CHECK(!sample.good() ||
                   (sample.value_C >= profile.valid_min_C && sample.value_C <= profile.valid_max_C));
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size < 7) return 0;
    constexpr int functions[] = {3, 4, 5, 6};
    const Request request{.unit_id = data[0],
                          .function = functions[data[1] % 4],
                          .address = data[2] * 256 + data[3],
                          .count_or_value = 1 + data[4] % max_registers_per_read};
    const auto transaction_id = static_cast<std::uint16_t>(data[5]);
    const Bytes frame(data + 7, size - 7);
    const bool tcp = data[6] % 2 == 0;
    const auto pdu = tcp ? pdu_of_tcp_reply(frame, transaction_id, request.unit_id)
                         : pdu_of_rtu_reply(frame, request.unit_id);
    if (!pdu) return 0;
    FUZZ_CHECK(frame[tcp ? 6 : 0] == request.unit_id);
    FUZZ_CHECK(!tcp || (frame[0] * 256 + frame[1] == transaction_id && frame[2] == 0 && frame[3] == 0 &&
                        std::size_t{frame[4]} * 256 + frame[5] == frame.size() - 6));
    const auto registers = check_reply(request, *pdu);
    if (!registers) return 0;
    check_registers(request, *pdu, *registers);
    check_samples(*registers, data[6] / 2);
    return 0;
}
