#include "model_input.hpp"

#include "config/model_file.hpp"
#include "files.hpp"

namespace thermbal {

Result<Model> read_model(const std::string& path) {
    const auto text = read_file(path);
    if (!text) return std::unexpected(text.error());
    return load_model(*text, path);
}

Result<RecordedTest> read_recorded_test(const std::string& path) {
    const auto text = read_file(path);
    if (!text) return std::unexpected(text.error());
    return parse_recorded_test(*text, path);
}

}  // namespace thermbal
