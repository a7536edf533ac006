#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "base/error.hpp"
#include "config/config.hpp"

struct mosquitto;

namespace thermbal {

struct BrokerOptions {
    MqttConfig mqtt;       ///< client_id and machine are filled in
    std::string password;  ///< empty: none
    std::string ca_path;   ///< files of mqtt, credentials resolved
    std::string certificate_path;
    std::string key_path;
    std::string status_topic;
    std::string last_will;  ///< what the broker says at status_topic when this client is gone
};

/// One connection to a broker, MQTT 3.1.1, from connect to the first thing that goes wrong; then make a new
/// one. What was not acknowledged is forgotten with it: the database still has it. One thread, no thread of
/// its own.
class Connection {
  public:
    /// Waits for the TCP connection (the system's limit), not for the broker's answer. `retry` when nobody is
    /// there; `refuse_input` for certificates and keys that cannot be used.
    static Result<Connection> open(const BrokerOptions& options);

    /// Waits at most `wait_ms` for the network and does what there is to do. Error (retry): the connection is
    /// lost or was refused.
    Result<void> run(int wait_ms);

    /// The broker has accepted this client.
    bool ready() const;

    /// QoS 1. Returns the message's number, which comes back in take_acknowledged().
    Result<int> publish(const std::string& topic, std::string_view payload, bool retain);

    /// The numbers of the messages that the broker acknowledged since the last call.
    std::vector<int> take_acknowledged();

    /// Says goodbye: the broker then does not tell the last will.
    void close();

    Connection(Connection&&) noexcept;
    Connection& operator=(Connection&&) noexcept;
    ~Connection();

  private:
    struct Parts;
    explicit Connection(std::unique_ptr<Parts> parts);
    std::unique_ptr<Parts> parts_;
};

}  // namespace thermbal
