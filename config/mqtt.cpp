#include "mqtt.hpp"

#include <fmt/format.h>

namespace thermbal {
namespace {

/// A file that is read as it starts: a path, or what systemd hands over.
void read_file_name(TableReader& reader, std::string_view key, std::string& name) {
    const auto found = reader.text(key);
    if (!found) return;
    const bool credential =
        found->starts_with("credential:") && found->size() > 11 && found->find('/') == std::string::npos;
    if (credential || found->starts_with('/'))
        name = *found;
    else
        reader.complain(key, fmt::format("found \"{}\"; accepted: a path that begins with /, or "
                                         "\"credential:NAME\" for a credential of the systemd unit",
                                         *found));
}

void check_topic_prefix(TableReader& reader, const std::string& prefix) {
    // 65535 bytes are MQTT's limit for a whole topic; the rest is for the machine and the channel.
    if (prefix.empty() || prefix.size() > 1000 || prefix.starts_with('$') ||
        prefix.find_first_of("+#") != std::string::npos)
        reader.complain("topic_prefix",
                        fmt::format("found \"{}\"; accepted: levels separated by /, without + and #, not "
                                    "beginning with $, at most 1000 bytes",
                                    prefix));
}

void read_tls(TableReader& reader, MqttConfig& mqtt) {
    read_file_name(reader, "ca_file", mqtt.ca_file);
    read_file_name(reader, "certificate_file", mqtt.certificate_file);
    read_file_name(reader, "key_file", mqtt.key_file);
    mqtt.tls = !mqtt.ca_file.empty() || !mqtt.certificate_file.empty();
    set(mqtt.tls, reader.boolean("tls"));
    if (mqtt.certificate_file.empty() != mqtt.key_file.empty())
        reader.complain("key_file", "accepted: certificate_file and key_file together, or neither");
    if (!mqtt.tls && (!mqtt.ca_file.empty() || !mqtt.certificate_file.empty()))
        reader.complain("tls", "found false; accepted: true, where ca_file or certificate_file is given");
}

std::string optional_line(std::string_view key, const std::string& value) {
    return value.empty() ? std::string() : fmt::format("{} = {}\n", key, toml_quoted(value));
}

}  // namespace

MqttConfig read_mqtt(TableReader& reader) {
    MqttConfig mqtt;
    reader.require("host", "the broker's name or address");
    set(mqtt.host, reader.text("host"));
    if (reader.has("host") && mqtt.host.empty())
        reader.complain("host", "is empty; accepted: a name or an address");
    read_tls(reader, mqtt);
    mqtt.port = mqtt.tls ? 8883 : 1883;
    set(mqtt.port, reader.integer("port", {1, 65535}));
    set(mqtt.topic_prefix, reader.text("topic_prefix"));
    check_topic_prefix(reader, mqtt.topic_prefix);
    set(mqtt.machine, reader.text("machine"));
    set(mqtt.client_id, reader.text("client_id"));
    set(mqtt.username, reader.text("username"));
    read_file_name(reader, "password_file", mqtt.password_file);
    if (!mqtt.password_file.empty() && mqtt.username.empty())
        reader.complain("username", "is missing; accepted: the name that the password belongs to");
    set(mqtt.keepalive_s, reader.integer("keepalive_s", {5, 3600}));
    set(mqtt.settle_s, reader.number("settle_s", {0.0, 86'400.0}));
    if (const auto backlog = reader.choice("backlog", {"newest_test", "all"}))
        mqtt.backlog = *backlog == 0 ? MqttConfig::Backlog::newest_test : MqttConfig::Backlog::all;
    return mqtt;
}

std::string explain_mqtt(const MqttConfig& mqtt) {
    std::string text =
        fmt::format("\n[mqtt]\nhost = {}\nport = {}\ntls = {}\ntopic_prefix = {}\n", toml_quoted(mqtt.host),
                    mqtt.port, mqtt.tls, toml_quoted(mqtt.topic_prefix));
    text += optional_line("ca_file", mqtt.ca_file);
    text += optional_line("certificate_file", mqtt.certificate_file);
    text += optional_line("key_file", mqtt.key_file);
    text += optional_line("machine", mqtt.machine);
    text += optional_line("client_id", mqtt.client_id);
    text += optional_line("username", mqtt.username);
    text += optional_line("password_file", mqtt.password_file);
    return text + fmt::format("keepalive_s = {}\nsettle_s = {}\nbacklog = \"{}\"\n", mqtt.keepalive_s,
                              mqtt.settle_s,
                              mqtt.backlog == MqttConfig::Backlog::newest_test ? "newest_test" : "all");
}

}  // namespace thermbal
