// A configuration: what is accepted means the same when it is written out and read again.
#include <cstdint>
#include <string>

#include "check.hpp"
#include "config/load.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace thermbal;
    const ProfileLookup lookup = [](std::string_view name) -> Result<ModuleProfile> {
        if (name.empty() || name.front() == '!') return fail(NextStep::refuse_input, "no such profile");
        ModuleProfile profile;
        profile.name = std::string(name);
        return profile;
    };
    const auto config = load_config({reinterpret_cast<const char*>(data), size}, "fuzz.toml", lookup);
    if (!config) {
        FUZZ_CHECK(config.error().next == NextStep::refuse_input && !config.error().message.empty());
        return 0;
    }
    for (const LineConfig& line : config->lines) {
        LinkOptions link = line.link;
        if (line.usb) link.device = "/dev/any";
        FUZZ_CHECK(check_link_options(link).empty());
    }
    const std::string text = explain_config(*config);
    const auto again = load_config(text, "again.toml", lookup);
    FUZZ_CHECK(again && explain_config(*again) == text);
    return 0;
}
