#pragma once

#include <cstddef>
#include <deque>
#include <optional>
#include <string>

#include <nlohmann/json.hpp>

namespace thermbal {

/// All that the live view shows, as the daemon sent it.
struct WatchScene {
    enum class Page { channels, channel, events, help };

    nlohmann::json status;              ///< of the method `status`
    nlohmann::json channels;            ///< of the method `channels`
    nlohmann::json curve;               ///< one element of `curve`, of the chosen channel
    std::deque<nlohmann::json> events;  ///< oldest first
    std::optional<double> scan_age_s;   ///< how long ago the newest scan came
    std::string trouble;                ///< why the figures are old; empty while the daemon answers
    Page page = Page::channels;
    std::optional<std::size_t> chosen;  ///< index into channels
    std::size_t events_back = 0;        ///< how many of the newest events are scrolled away
};

struct FrameSize {
    std::size_t rows = 24;
    std::size_t columns = 80;
};

struct FrameLook {
    bool colour = false;
    bool unicode = false;
};

/// The whole screen: exactly `rows` lines without a newline after the last, none wider than `columns`;
/// colours are SGR sequences. From 80x24 on all 16 channels are on it; smaller ones lose columns first, then
/// events, then scroll.
std::string render_frame(const WatchScene& scene, FrameSize size, FrameLook look);

/// A scan in one line without its end: "62.25 min T1=18.02 T2=open ... running, 9 of 15 declared".
std::string scan_line(const nlohmann::json& channels, const nlohmann::json& status);

/// Of the channels that the stop waits for: how many are declared, out of how many.
struct DeclaredCount {
    std::size_t declared = 0;
    std::size_t required = 0;
};
DeclaredCount count_declared(const nlohmann::json& channels);

}  // namespace thermbal
