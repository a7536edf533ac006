#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "base/backoff.hpp"
#include "connection.hpp"
#include "presence.hpp"
#include "publish/outbox.hpp"
#include "publish/topics.hpp"
#include "store/feed.hpp"

namespace thermbal {

struct PublisherOptions {
    BrokerOptions broker;
    Topics topics;
    std::filesystem::path database;
    std::filesystem::path position_file;
    std::string socket;  ///< the daemon's
    std::string version;
};

/// Sends what a database holds to a broker, oldest first, and goes on with what comes. What is on its way is
/// bounded; everything else waits in the database. Both ends may go away and come back. One thread.
class Publisher {
  public:
    explicit Publisher(PublisherOptions options);

    /// One turn of the loop: at most about 0.2 s (connecting and a daemon that hangs may take longer). Error
    /// (refuse_input, stop): a person has to mend something.
    Result<void> turn();

    /// Everything that the database holds is acknowledged.
    bool all_sent() const { return all_read_ && outbox_ && outbox_->in_flight() == 0; }

    /// Says goodbye and keeps the position. With `settled`, what is acknowledged is not sent again.
    void end(bool settled);

  private:
    Result<void> open_database();
    Result<void> choose_position();
    bool database_was_replaced(double now_s);
    Result<void> connect(double now_s);
    void lose_connection(const Error& error, double now_s);
    Result<void> serve(double now_s);
    Result<void> send_news();
    Result<void> send_retained(double now_s);
    Result<void> publish_if_new(const std::string& topic, std::string payload, std::string& last);
    std::string status_message(bool online, bool daemon_running) const;
    void keep_position();
    void say_once(const std::string& trouble);

    PublisherOptions options_;
    Presence presence_;
    Backoff backoff_;
    double connect_at_s_ = 0.0;
    std::optional<Connection> connection_;
    bool greeted_ = false;

    std::optional<Feed> feed_;
    std::uintmax_t file_number_ = 0;
    double looked_at_file_s_ = 0.0;
    std::optional<std::int64_t> read_version_;  ///< of the database, when it was read to the end
    std::optional<std::int64_t> test_version_;  ///< of the database, when the test message was made
    bool all_read_ = false;

    std::optional<Outbox> outbox_;
    FeedPosition next_;  ///< everything up to here is on its way or acknowledged
    FeedPosition saved_;
    double saved_at_s_ = 0.0;
    std::string last_status_;
    std::string last_test_;
    std::string trouble_;
};

/// Seconds of a clock that never falls.
double steady_s();

}  // namespace thermbal
