#include "samples.hpp"

#include <algorithm>
#include <utility>

#include "fields.hpp"

namespace thermbal {

using nlohmann::json;

Result<void> ask_samples(const std::function<Result<json>(const json& params)>& ask, json params,
                         std::int64_t wanted, const std::function<void(json answer)>& take) {
    constexpr std::int64_t most_accepted = 10'000;
    while (wanted > 0) {
        params["limit"] = std::min(wanted, most_accepted);
        auto answer = ask(params);
        if (!answer) return std::unexpected(answer.error());
        const json& scans = list(*answer, "scans");
        const auto got = static_cast<std::int64_t>(scans.size());
        const auto last = got > 0 ? number(scans.back(), "scan") : std::nullopt;
        take(std::move(*answer));
        if (!last) break;
        params["from_scan"] = static_cast<std::int64_t>(*last) + 1;
        wanted -= got;
    }
    return {};
}

}  // namespace thermbal
