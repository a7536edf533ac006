#include "report/spectrum_json.hpp"

namespace thermbal {

nlohmann::json spectrum_to_json(const ArchivedSpectrum& spectrum) {
    nlohmann::json responses = nlohmann::json::array();
    for (const ArchivedSpectrum::Response& response : spectrum.responses) {
        responses.push_back({{"channel", response.channel},
                             {"rise_C", response.rise_C},
                             {"amplitude_C", response.amplitude_C}});
    }
    return {{"time_constant_min", spectrum.time_constant_min},
            {"mode_density", spectrum.mode_density},
            {"mode_log_variance", spectrum.mode_log_variance},
            {"responses", std::move(responses)}};
}

Result<ArchivedSpectrum> spectrum_from_json(const nlohmann::json& json) {
    try {
        ArchivedSpectrum spectrum;
        spectrum.time_constant_min = json.at("time_constant_min").get<std::vector<double>>();
        spectrum.mode_density = json.at("mode_density").get<std::vector<double>>();
        spectrum.mode_log_variance = json.at("mode_log_variance").get<std::vector<double>>();
        for (const nlohmann::json& response : json.at("responses")) {
            spectrum.responses.push_back({response.at("channel").get<std::string>(),
                                          response.at("rise_C").get<double>(),
                                          response.at("amplitude_C").get<std::vector<double>>()});
        }
        return spectrum;
    } catch (const nlohmann::json::exception& error) {
        return fail(NextStep::stop, std::string("an archived spectrum cannot be read: ") + error.what());
    }
}

}  // namespace thermbal
