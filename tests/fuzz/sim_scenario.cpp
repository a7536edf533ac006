// What people give to thermbal-sim: scenarios, faults, lines of the control socket, requests.
#include <cstdint>
#include <string_view>

#include "check.hpp"
#include "simulator/control.hpp"
#include "simulator/frames.hpp"
#include "simulator/scenario.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace thermbal;
    const std::string_view text(reinterpret_cast<const char*>(data), size);
    if (const auto faults = parse_scenario(text, "fuzz.toml")) {
        for (const Fault& fault : *faults) FUZZ_CHECK(parse_fault(to_string(fault)));
    }
    if (const auto fault = parse_fault(text)) FUZZ_CHECK(parse_fault(to_string(*fault)));
    FaultPlan plan;
    const std::string answer = obey(text, plan, 10.0);
    FUZZ_CHECK(answer.starts_with("ok") || answer.starts_with("error "));
    for (const bool silence : {false, true}) {
        const ParsedRequest parsed = parse_rtu_request({data, size}, silence);
        FUZZ_CHECK(parsed.consumed <= size);
    }
    FUZZ_CHECK(parse_tcp_request({data, size}).consumed <= size);
    return 0;
}
