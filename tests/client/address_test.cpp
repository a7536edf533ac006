#include "address.hpp"

#include <gtest/gtest.h>

namespace thermbal {
namespace {

TEST(NetworkAddressText, NamesAHostAndPerhapsAPort) {
    struct Case {
        const char* text;
        const char* host;
        std::optional<int> port;
    };
    for (const Case& expected : {Case{"module.lan", "module.lan", std::nullopt},
                                 {"module.lan:502", "module.lan", 502},
                                 {"127.0.0.1:0", "127.0.0.1", 0},
                                 {"::1", "::1", std::nullopt},
                                 {"[fe80::1]", "fe80::1", std::nullopt},
                                 {"[::1]:65535", "::1", 65535}}) {
        const auto address = network_address(expected.text);
        ASSERT_TRUE(address) << expected.text;
        EXPECT_EQ(address->host, expected.host);
        EXPECT_EQ(address->port, expected.port);
    }
}

TEST(NetworkAddressText, IsNoneWithAPortThatIsNoneOrWithoutAHost) {
    for (const char* text : {"", ":", ":9", "host:", "host:modbus", "host:65536", "host:-1", "host:123456",
                             "host: 5", "[::1", "[::1]5", "[::1]:", "[]:5"})
        EXPECT_FALSE(network_address(text)) << text;
}

}  // namespace
}  // namespace thermbal
