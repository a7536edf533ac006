// Reads one unit of 16 inputs once and prints `raw value quality` an input: what peer_pymodbus_test.py
// drives. modbus_read tcp HOST PORT UNIT | modbus_read rtu DEVICE BAUD UNIT
#include <cstdlib>
#include <string>

#include <fmt/format.h>

#include "modbus/unit.hpp"

int main(int argc, char** argv) {
    using namespace thermbal;
    if (argc != 5) return 2;
    LinkOptions options;
    options.name = "peer";
    if (std::string(argv[1]) == "tcp") {
        options.host = argv[2];
        options.port = std::atoi(argv[3]);
    } else {
        options.transport = Transport::rtu;
        options.device = argv[2];
        options.baud = std::atoi(argv[3]);
    }
    ModuleProfile profile;
    profile.faults = {{.first = 32767, .last = 32767, .quality = Quality::open},
                      {.first = -32768, .last = -32768, .quality = Quality::shorted}};
    const auto link = make_link(options);
    const UnitReading reading =
        read_unit(*link, plan_unit(std::atoi(argv[4]), profile, false), [] { return 0; });
    if (reading.error) {
        fmt::print(stderr, "{}\n", reading.error->message);
        return 1;
    }
    for (const Sample& sample : reading.samples) {
        fmt::print("{} {:.1f} {}\n", sample.raw.value_or(0), sample.value_C, to_string(sample.quality));
    }
    return 0;
}
