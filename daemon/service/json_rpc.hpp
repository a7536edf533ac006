#pragma once

#include <expected>
#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

namespace thermbal::json_rpc {

// Codes of JSON-RPC 2.0, section 5.1, and ours from its range for servers.
inline constexpr int parse_error = -32700;
inline constexpr int invalid_request = -32600;
inline constexpr int unknown_method = -32601;
inline constexpr int invalid_params = -32602;
inline constexpr int failed = -32000;
inline constexpr int permission_denied = -32001;
inline constexpr int reply_too_large = -32002;
inline constexpr int try_again = -32003;

struct Call {
    nlohmann::json id;
    bool notification = false;
    std::string method;
    nlohmann::json params = nlohmann::json::object();
};

struct Failure {
    int code = failed;
    std::string message;
    nlohmann::json id;  ///< null when the request's id could not be read
};

/// One line, without its end.
std::expected<Call, Failure> parse(std::string_view line);

/// One line each, with its end. Text that is not UTF-8 is replaced, never refused.
std::string reply(const nlohmann::json& id, nlohmann::json result);
std::string error_reply(const Failure& failure);
std::string notification(std::string_view method, const nlohmann::json& params);

}  // namespace thermbal::json_rpc
