#include <gmock/gmock.h>

#include "serial/ports.hpp"

namespace thermbal {
namespace {

using ::testing::HasSubstr;

const std::vector<PortInfo> three_ports{
    {.path = "/dev/ttyS0",
     .by_id_path = "",
     .description = "ttyS0",
     .usb_vid = 0,
     .usb_pid = 0,
     .serial = ""},
    {.path = "/dev/ttyUSB0",
     .by_id_path = "/dev/serial/by-id/usb-1a86_USB_Serial-if00-port0",
     .description = "USB Serial",
     .usb_vid = 0x1a86,
     .usb_pid = 0x7523,
     .serial = ""},
    {.path = "/dev/ttyUSB1",
     .by_id_path = "/dev/serial/by-id/usb-FTDI_FT232R_A50285BI-if00-port0",
     .description = "FT232R",
     .usb_vid = 0x0403,
     .usb_pid = 0x6001,
     .serial = "A50285BI"}};

PortSelector by_id(int vid, int pid) {
    return {.usb_vid = vid, .usb_pid = pid, .serial = {}, .path = {}};
}
PortSelector by_serial(const std::string& serial) {
    return {.usb_vid = {}, .usb_pid = {}, .serial = serial, .path = {}};
}
PortSelector by_path(const std::string& path) {
    return {.usb_vid = {}, .usb_pid = {}, .serial = {}, .path = path};
}

std::string path_of(const PortSelector& selector) {
    const auto port = match_port(three_ports, selector);
    return port ? port->path : "error: " + port.error().message;
}

TEST(MatchPort, ByWhatItIs) {
    EXPECT_EQ(path_of(by_id(0x1a86, 0x7523)), "/dev/ttyUSB0");
    EXPECT_EQ(path_of(by_serial("A50285BI")), "/dev/ttyUSB1");
    EXPECT_EQ(path_of(by_path("/dev/serial/by-id/usb-FTDI_FT232R_A50285BI-if00-port0")), "/dev/ttyUSB1");
    EXPECT_EQ(path_of(by_path("/dev/ttyS0")), "/dev/ttyS0");
}

TEST(MatchPort, EveryFieldHasToMatch) {
    PortSelector both = by_id(0x0403, 0x6001);
    both.serial = "A50285BI";
    EXPECT_EQ(path_of(both), "/dev/ttyUSB1");
    both.serial = "B1";
    EXPECT_THAT(path_of(both),
                HasSubstr("no serial port is USB 0403:6001, serial number B1; there is /dev/ttyS0"));
}

TEST(MatchPort, NoneAndSeveralAndNothingAsked) {
    EXPECT_THAT(match_port({}, by_id(1, 2)).error().message, HasSubstr("there is no serial port"));
    EXPECT_EQ(match_port({}, by_id(1, 2)).error().next, NextStep::reopen_link);
    std::vector<PortInfo> twins(2, three_ports[1]);
    twins[1].path = "/dev/ttyUSB5";
    EXPECT_THAT(match_port(twins, by_id(0x1a86, 0x7523)).error().message,
                HasSubstr("2 serial ports are USB 1a86:7523"));
    EXPECT_EQ(match_port(three_ports, PortSelector{}).error().next, NextStep::refuse_input);
}

TEST(VidPid, AsLsusbPrintsIt) {
    const auto selector = parse_vid_pid("1a86:7523");
    ASSERT_TRUE(selector);
    EXPECT_EQ(selector->usb_vid, 0x1a86);
    EXPECT_EQ(selector->usb_pid, 0x7523);
    for (const char* wrong :
         {"", ":", "1a86", "1a86:", ":7523", "1a86:752x", "11a86:7523", "-1:2", "0x1:2", "1:2:3"}) {
        EXPECT_FALSE(parse_vid_pid(wrong)) << wrong;
    }
}

TEST(ListPorts, AnswersOnEveryMachineSortedAndNamed) {
    const auto ports = list_ports();
    ASSERT_TRUE(ports) << ports.error().message;
    for (std::size_t i = 0; i < ports->size(); ++i) {
        EXPECT_TRUE((*ports)[i].path.starts_with("/dev/"));
        EXPECT_TRUE(i == 0 || (*ports)[i - 1].path < (*ports)[i].path);
    }
}

}  // namespace
}  // namespace thermbal
