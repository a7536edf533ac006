// A module profile: what is accepted means the same when it is written out and read again.
#include <cstdint>
#include <string_view>

#include "check.hpp"
#include "config/load.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace thermbal;
    const auto profile = load_profile({reinterpret_cast<const char*>(data), size}, "fuzz.toml");
    if (!profile) {
        FUZZ_CHECK(profile.error().next == NextStep::refuse_input && !profile.error().message.empty());
        return 0;
    }
    FUZZ_CHECK(check_profile(*profile).empty());
    const std::string text = explain_profile(*profile);
    const auto again = load_profile(text, "again.toml");
    FUZZ_CHECK(again && explain_profile(*again) == text);
    return 0;
}
