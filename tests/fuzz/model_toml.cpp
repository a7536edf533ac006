// A simulation model: what is accepted means the same when it is written out and read again.
#include <cstdint>
#include <string>

#include "check.hpp"
#include "config/model_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace thermbal;
    const auto model = load_model({reinterpret_cast<const char*>(data), size}, "fuzz.toml");
    if (!model) {
        FUZZ_CHECK(model.error().next == NextStep::refuse_input && !model.error().message.empty());
        return 0;
    }
    const std::string text = write_model(*model);
    const auto again = load_model(text, "again.toml");
    FUZZ_CHECK(again && write_model(*again) == text);
    return 0;
}
