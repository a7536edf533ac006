#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "live_feed.hpp"

namespace thermbal {

/// What every reader of the dashboard is shown: the daemon's scene, and the whole course of its test. One
/// thread follows the daemon (follow), any number of others read.
class LiveState {
  public:
    explicit LiveState(std::string socket) : feed_(std::move(socket)) {}

    /// The first connection. Errors: nobody is there, or it refuses.
    Result<void> open() { return feed_.open(); }
    /// Follows the daemon until `stop` is requested, across its restarts.
    void follow(const std::stop_token& stop);

    /// What a reader has seen already.
    struct Seen {
        std::uint64_t version = 0;
        std::uint64_t refills = 0;
        std::size_t rows = 0;
    };
    /// The next message for a reader, as JSON: the scene, and the course whole ("history") or what has come
    /// since ("rows": [time_min, T1, ...]). nullopt when nothing new came within `limit`.
    std::optional<std::string> next(Seen& seen, std::chrono::milliseconds limit);
    /// Wakes every reader, who then get nullopt at once.
    void close();

  private:
    void take(const std::vector<Notification>& notifications);
    void take_scan(const nlohmann::json& channels);
    void refill();
    void publish();
    nlohmann::json history() const;

    LiveFeed feed_;
    nlohmann::json predictions_ = nlohmann::json::array();
    std::mutex mutex_;  ///< of all below
    std::condition_variable changed_;
    std::uint64_t version_ = 0;
    std::uint64_t refills_ = 0;  ///< how often the course was read anew: another test, a restart
    bool closed_ = false;
    nlohmann::json scene_;
    std::int64_t test_ = -1;
    std::vector<std::string> names_;
    std::vector<double> time_min_;
    std::vector<std::vector<double>> columns_;  ///< of names_, NaN where a reading is not good
};

}  // namespace thermbal
