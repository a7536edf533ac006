#include "fault_draws.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace thermbal::soak {
namespace {

/// What the catalogue does not say: which values are worth drawing.
std::vector<FaultDraw> draws_of(const FaultEntry& entry) {
    FaultDraw draw{.name = std::string(entry.name), .kind = entry.kind};
    switch (entry.kind) {
        case FaultKind::code:  // the generic profile's two, and words that are beyond its range
            draw.values = {0x7FFF, 0x8000, 0x7FFE, -32767, 8501, -2001, 30000, -30000};
            break;
        case FaultKind::late:
            draw.timeouts_from = 0.2;
            draw.timeouts_to = 4.0;
            break;
        case FaultKind::trickle:  // 21 bytes and more a reply: whole in time, or not
            draw.timeouts_from = 0.01;
            draw.timeouts_to = 0.1;
            break;
        case FaultKind::duplicate:
        case FaultKind::unsolicited:
            draw.timeouts_from = 0.0;
            draw.timeouts_to = 2.0;
            break;
        case FaultKind::noise:
            draw.fewest = 1;
            draw.most = 300;
            break;
        case FaultKind::one_client:
            draw.timeouts_from = 0.0;
            draw.timeouts_to = 2.0;
            draw.drops_connections = true;
            break;
        case FaultKind::exception: {
            std::vector<FaultDraw> each;
            for (const double code : {1, 2, 3, 4, 5, 6, 10, 11}) {
                each.push_back(
                    {.name = fmt::format("exception={}", code), .kind = entry.kind, .values = {code}});
            }
            return each;
        }
        default:
            break;
    }
    return {draw};
}

double uniform(std::mt19937_64& random, double from, double to) {
    return std::uniform_real_distribution(from, to)(random);
}

}  // namespace

Fault FaultDraw::draw(std::mt19937_64& random, double response_timeout_s) const {
    Fault fault{.kind = kind};
    if (!values.empty()) fault.value = values[random() % values.size()];
    if (timeouts_to > 0.0) fault.value = uniform(random, timeouts_from, timeouts_to) * response_timeout_s;
    if (most > 0.0)
        fault.value = fewest + static_cast<double>(random() % static_cast<std::uint64_t>(most - fewest));
    // One unit in two of three draws, so that what it does to the other one is seen.
    const bool all = random() % 3 == 0;
    const FaultPlace place = fault.place();
    if (place == FaultPlace::sensor && !all) fault.channel = random() % 16;
    if ((place == FaultPlace::reply || place == FaultPlace::module) && !all) {
        fault.unit = static_cast<std::uint8_t>(1 + random() % units);
    }
    return fault;
}

std::vector<FaultDraw> fault_draws(Transport transport, std::size_t units) {
    const FaultFraming other = transport == Transport::tcp ? FaultFraming::rtu : FaultFraming::tcp;
    std::vector<FaultDraw> draws;
    for (const FaultEntry& entry : fault_catalogue()) {
        if (entry.framing == other) continue;
        std::ranges::copy(draws_of(entry), std::back_inserter(draws));
    }
    for (FaultDraw& draw : draws) draw.units = units;
    return draws;
}

}  // namespace thermbal::soak
