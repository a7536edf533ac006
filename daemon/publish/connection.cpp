#include "connection.hpp"

#include <cerrno>
#include <utility>

#include <fmt/format.h>
#include <mosquitto.h>

#include "base/errno_text.hpp"

namespace thermbal {
namespace {

constexpr int at_least_once = 1;

void prepare_library() {
    static const int done = mosquitto_lib_init();
    static_cast<void>(done);
}

std::string reason(int code) {
    return code == MOSQ_ERR_ERRNO ? errno_text(errno) : mosquitto_strerror(code);
}

const char* or_null(const std::string& text) {
    return text.empty() ? nullptr : text.c_str();
}

}  // namespace

struct Connection::Parts {
    std::unique_ptr<mosquitto, void (*)(mosquitto*)> client{nullptr, mosquitto_destroy};
    std::string broker;  ///< for messages
    bool ready = false;
    std::string refused;  ///< the broker's reason
    std::vector<int> acknowledged;

    std::unexpected<Error> trouble(NextStep next, const std::string& what) const {
        return fail(next, fmt::format("broker {}: {}", broker, what));
    }

    Result<void> prepare(const BrokerOptions& options);
    Result<void> prepare_tls(const BrokerOptions& options);

    // libmosquitto calls these from inside run(), in the same thread.
    static void on_connect(mosquitto* /*client*/, void* self, int code) {
        auto& parts = *static_cast<Parts*>(self);
        parts.ready = code == 0;
        if (code != 0) parts.refused = mosquitto_connack_string(code);
    }
    static void on_publish(mosquitto* /*client*/, void* self, int message_id) {
        static_cast<Parts*>(self)->acknowledged.push_back(message_id);
    }
};

Result<void> Connection::Parts::prepare_tls(const BrokerOptions& options) {
    if (!options.mqtt.tls) return {};
    const char* const system_authorities = "/etc/ssl/certs";
    // Without a terminal to ask, a key with a passphrase is refused instead of waiting for one.
    const auto no_passphrase = [](char*, int, int, void*) { return 0; };
    const int set = mosquitto_tls_set(
        client.get(), or_null(options.ca_path), options.ca_path.empty() ? system_authorities : nullptr,
        or_null(options.certificate_path), or_null(options.key_path), no_passphrase);
    if (set != MOSQ_ERR_SUCCESS)
        return trouble(
            NextStep::refuse_input,
            fmt::format("TLS: ca_file, certificate_file or key_file cannot be used: {}", reason(set)));
    return {};
}

Result<void> Connection::Parts::prepare(const BrokerOptions& options) {
    mosquitto* const handle = client.get();
    // What waits for an acknowledgement is bounded by the sender, not here.
    mosquitto_max_inflight_messages_set(handle, 0);
    mosquitto_connect_callback_set(handle, &Parts::on_connect);
    mosquitto_publish_callback_set(handle, &Parts::on_publish);
    const auto& will = options.last_will;
    int done = mosquitto_will_set(handle, options.status_topic.c_str(), static_cast<int>(will.size()),
                                  will.data(), at_least_once, true);
    if (done == MOSQ_ERR_SUCCESS && !options.mqtt.username.empty())
        done = mosquitto_username_pw_set(handle, options.mqtt.username.c_str(), or_null(options.password));
    if (done != MOSQ_ERR_SUCCESS) return trouble(NextStep::refuse_input, reason(done));
    return prepare_tls(options);
}

Result<Connection> Connection::open(const BrokerOptions& options) {
    prepare_library();
    auto parts = std::make_unique<Parts>();
    parts->broker = fmt::format("{}:{}", options.mqtt.host, options.mqtt.port);
    parts->client.reset(mosquitto_new(options.mqtt.client_id.c_str(), true, parts.get()));
    if (!parts->client) return parts->trouble(NextStep::stop, reason(MOSQ_ERR_ERRNO));
    if (auto prepared = parts->prepare(options); !prepared) return std::unexpected(prepared.error());
    const int connected = mosquitto_connect(parts->client.get(), options.mqtt.host.c_str(), options.mqtt.port,
                                            options.mqtt.keepalive_s);
    if (connected != MOSQ_ERR_SUCCESS) return parts->trouble(NextStep::retry, reason(connected));
    return Connection(std::move(parts));
}

Result<void> Connection::run(int wait_ms) {
    const int done = mosquitto_loop(parts_->client.get(), wait_ms, 1);
    if (!parts_->refused.empty()) return parts_->trouble(NextStep::retry, parts_->refused);
    if (done != MOSQ_ERR_SUCCESS) return parts_->trouble(NextStep::retry, reason(done));
    return {};
}

bool Connection::ready() const {
    return parts_->ready;
}

Result<int> Connection::publish(const std::string& topic, std::string_view payload, bool retain) {
    int message_id = 0;
    const int done =
        mosquitto_publish(parts_->client.get(), &message_id, topic.c_str(), static_cast<int>(payload.size()),
                          payload.data(), at_least_once, retain);
    if (done != MOSQ_ERR_SUCCESS) return parts_->trouble(NextStep::retry, reason(done));
    return message_id;
}

std::vector<int> Connection::take_acknowledged() {
    return std::exchange(parts_->acknowledged, {});
}

void Connection::close() {
    mosquitto_disconnect(parts_->client.get());
}

Connection::Connection(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}
Connection::Connection(Connection&&) noexcept = default;
Connection& Connection::operator=(Connection&&) noexcept = default;
Connection::~Connection() = default;

}  // namespace thermbal
