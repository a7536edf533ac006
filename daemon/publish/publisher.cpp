#include "publisher.hpp"

#include <chrono>
#include <random>
#include <thread>

#include <nlohmann/json.hpp>
#include <spdlog/spdlog.h>
#include <sys/stat.h>

#include "publish/backlog.hpp"
#include "publish/position_file.hpp"

namespace thermbal {
namespace {

constexpr std::size_t most_in_flight = 100;
constexpr int turn_ms = 200;
constexpr double look_at_file_every_s = 10.0;
constexpr double save_every_s = 1.0;

/// Which file a path names at the moment; 0 when there is none.
std::uintmax_t file_number(const std::filesystem::path& path) {
    struct stat file{};
    return stat(path.c_str(), &file) == 0 ? file.st_ino : 0;
}

void wait_a_turn() {
    std::this_thread::sleep_for(std::chrono::milliseconds(turn_ms));
}

/// What a later turn may find mended; everything else a person has to mend.
bool may_pass(const Error& error) {
    return error.next == NextStep::retry || error.next == NextStep::reopen_link;
}

}  // namespace

double steady_s() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

Publisher::Publisher(PublisherOptions options)
    : options_(std::move(options)), presence_(options_.socket), backoff_(1.0, 60.0, std::random_device{}()) {
    options_.broker.status_topic = options_.topics.status();
    options_.broker.last_will = status_message(false, false);
}

Result<void> Publisher::turn() {
    const double now_s = steady_s();
    if (database_was_replaced(now_s)) feed_.reset();
    if (!feed_) {
        if (auto opened = open_database(); !opened) {
            // The daemon makes the database, or brings it up to date, when it starts.
            say_once(opened.error().message);
            wait_a_turn();
            return {};
        }
    }
    if (!connection_) {
        if (now_s >= connect_at_s_) return connect(now_s);
        wait_a_turn();
        return {};
    }
    const bool more_to_send = !all_read_ && connection_->ready() && outbox_->in_flight() < most_in_flight;
    if (auto run = connection_->run(more_to_send ? 0 : turn_ms); !run) {
        lose_connection(run.error(), now_s);
        return {};
    }
    return serve(now_s);
}

Result<void> Publisher::open_database() {
    auto feed = Feed::open(options_.database);
    if (!feed) return std::unexpected(feed.error());
    feed_ = std::move(*feed);
    file_number_ = file_number(options_.database);
    read_version_.reset();
    test_version_.reset();
    return choose_position();
}

Result<void> Publisher::choose_position() {
    const bool known = outbox_ && outbox_->settled().database_id == feed_->database_id();
    if (known) return {};
    FeedPosition position;
    const auto kept = outbox_ ? std::nullopt : load_position(options_.position_file);
    if (kept && kept->database_id == feed_->database_id()) {
        position = *kept;
    } else if (options_.broker.mqtt.backlog == MqttConfig::Backlog::all) {
        position.database_id = feed_->database_id();
    } else {
        auto newest = feed_->before_newest_test();
        if (!newest) return std::unexpected(newest.error());
        position = std::move(*newest);
    }
    spdlog::info("database {}: sending what comes after test {}, scan {}", options_.database.string(),
                 position.test_id, position.scan);
    next_ = position;
    saved_ = position;
    outbox_.emplace(position, options_.broker.mqtt.settle_s);
    return {};
}

bool Publisher::database_was_replaced(double now_s) {
    if (!feed_ || now_s - looked_at_file_s_ < look_at_file_every_s) return false;
    looked_at_file_s_ = now_s;
    const std::uintmax_t number = file_number(options_.database);
    return number != 0 && number != file_number_;
}

Result<void> Publisher::connect(double now_s) {
    auto connection = Connection::open(options_.broker);
    if (connection) {
        connection_ = std::move(*connection);
        greeted_ = false;
        return {};
    }
    if (!may_pass(connection.error())) return std::unexpected(connection.error());
    connect_at_s_ = now_s + backoff_.failed_s();
    say_once(connection.error().message);
    return {};
}

void Publisher::lose_connection(const Error& error, double now_s) {
    say_once(error.message);
    connection_.reset();
    connect_at_s_ = now_s + backoff_.failed_s();
    outbox_->settle(now_s);
    outbox_->lost();
    next_ = outbox_->settled();
    read_version_.reset();
    all_read_ = false;
}

Result<void> Publisher::serve(double now_s) {
    for (const int message_id : connection_->take_acknowledged()) outbox_->acknowledged(message_id, now_s);
    outbox_->settle(now_s);
    if (now_s - saved_at_s_ >= save_every_s) {
        saved_at_s_ = now_s;
        keep_position();
    }
    if (!connection_->ready()) return {};
    if (!greeted_) {
        greeted_ = true;
        backoff_.succeeded();
        last_status_.clear();
        last_test_.clear();
        test_version_.reset();
        trouble_.clear();
        spdlog::info("broker {}:{}: connected", options_.broker.mqtt.host, options_.broker.mqtt.port);
    }
    auto sent = send_retained(now_s);
    if (sent) sent = send_news();
    if (sent) return {};
    if (sent.error().next == NextStep::stop) return sent;
    // The database is locked or away, or the broker just left: run() or open_database() will find out. Until
    // then there may always be more to send, for which run() does not wait.
    say_once(sent.error().message);
    wait_a_turn();
    return {};
}

Result<void> Publisher::send_news() {
    const auto version = feed_->version();
    if (!version) return std::unexpected(version.error());
    all_read_ = read_version_ == *version;
    while (!all_read_ && outbox_->in_flight() < most_in_flight) {
        const auto room = static_cast<std::int64_t>(most_in_flight - outbox_->in_flight());
        const auto messages = next_messages(*feed_, options_.topics, next_, room);
        if (!messages) return std::unexpected(messages.error());
        for (const Message& message : *messages) {
            const auto id = connection_->publish(message.topic, message.payload, false);
            if (!id) return std::unexpected(id.error());
            outbox_->sent(*id, message.after);
            next_ = message.after;
        }
        all_read_ = messages->empty();
        if (all_read_) read_version_ = *version;
    }
    return {};
}

std::string Publisher::status_message(bool online, bool daemon_running) const {
    return payload_text(
        {{"online", online},
         {"daemon", online ? nlohmann::json(daemon_running ? "running" : "away") : nlohmann::json(nullptr)},
         {"version", options_.version}});
}

Result<void> Publisher::publish_if_new(const std::string& topic, std::string payload, std::string& last) {
    if (payload == last) return {};
    const auto id = connection_->publish(topic, payload, true);
    if (!id) return std::unexpected(id.error());
    last = std::move(payload);
    return {};
}

Result<void> Publisher::send_retained(double now_s) {
    const std::string status = status_message(true, presence_.is_running(now_s));
    if (auto sent = publish_if_new(options_.topics.status(), status, last_status_); !sent) return sent;
    const auto version = feed_->version();
    if (!version) return std::unexpected(version.error());
    if (test_version_ == *version) return {};
    auto test = test_message(*feed_);
    if (!test) return std::unexpected(test.error());
    if (auto sent = publish_if_new(options_.topics.test(), std::move(*test), last_test_); !sent) return sent;
    test_version_ = *version;
    return {};
}

void Publisher::keep_position() {
    if (!outbox_ || outbox_->settled() == saved_) return;
    if (const auto saved = save_position(options_.position_file, outbox_->settled()); !saved)
        say_once(saved.error().message);
    else
        saved_ = outbox_->settled();
}

void Publisher::say_once(const std::string& trouble) {
    if (trouble == trouble_) return;
    trouble_ = trouble;
    spdlog::warn("{}", trouble);
}

void Publisher::end(bool settled) {
    if (outbox_) outbox_->settle(settled ? 1e18 : steady_s());
    keep_position();
    if (!connection_ || !connection_->ready()) return;
    if (const auto said =
            publish_if_new(options_.topics.status(), status_message(false, false), last_status_);
        said) {
        const double give_up_s = steady_s() + 1.0;
        while (steady_s() < give_up_s && connection_->run(50) && connection_->take_acknowledged().empty()) {
        }
    }
    connection_->close();
}

}  // namespace thermbal
