#include "json_rpc.hpp"

#include <algorithm>
#include <utility>

namespace thermbal::json_rpc {

using nlohmann::json;

namespace {

// A request needs three levels. Copying or printing a document recurses: depth is bounded before it is
// parsed.
constexpr int deepest = 32;

int depth_of(std::string_view text) {
    int depth = 0;
    int most = 0;
    bool in_string = false;
    bool escaped = false;
    for (const char c : text) {
        if (escaped) {
            escaped = false;
        } else if (in_string) {
            escaped = c == '\\';
            if (c == '"') in_string = false;
        } else if (c == '"') {
            in_string = true;
        } else if (c == '[' || c == '{') {
            most = std::max(most, ++depth);
        } else if (c == ']' || c == '}') {
            --depth;
        }
    }
    return most;
}

std::string line_of(const json& document) {
    return document.dump(-1, ' ', false, json::error_handler_t::replace) + '\n';
}

}  // namespace

std::expected<Call, Failure> parse(std::string_view line) {
    if (depth_of(line) > deepest)
        return std::unexpected(Failure{parse_error, "nested deeper than 32 levels", nullptr});
    json document = json::parse(line, nullptr, false);
    if (document.is_discarded())
        return std::unexpected(
            Failure{parse_error, "not JSON: one document a line, UTF-8, ended by a newline", nullptr});
    if (document.is_array())
        return std::unexpected(
            Failure{invalid_request, "batches are not supported: send one request a line", nullptr});
    if (!document.is_object())
        return std::unexpected(Failure{invalid_request, "not a JSON-RPC object", nullptr});

    Call call;
    call.notification = !document.contains("id");
    if (!call.notification) call.id = std::move(document["id"]);
    if (!call.id.is_null() && !call.id.is_string() && !call.id.is_number())
        return std::unexpected(Failure{invalid_request, "id must be a string or a number", nullptr});
    const auto refuse = [&](int code, const char* message) {
        return std::unexpected(Failure{code, message, std::move(call.id)});
    };
    if (document.value("jsonrpc", json()) != "2.0") return refuse(invalid_request, "jsonrpc must be \"2.0\"");
    const auto method = document.find("method");
    if (method == document.end() || !method->is_string())
        return refuse(invalid_request, "method must be a string");
    call.method = std::move(method->get_ref<std::string&>());
    if (const auto params = document.find("params"); params != document.end()) {
        if (!params->is_object())
            return refuse(invalid_params, "params must be an object of named parameters");
        call.params = std::move(*params);
    }
    return call;
}

std::string reply(const json& id, json result) {
    json document = {{"jsonrpc", "2.0"}, {"id", id}};
    document["result"] = std::move(result);
    return line_of(document);
}

std::string error_reply(const Failure& failure) {
    return line_of({{"jsonrpc", "2.0"},
                    {"id", failure.id},
                    {"error", {{"code", failure.code}, {"message", failure.message}}}});
}

std::string notification(std::string_view method, const json& params) {
    return line_of({{"jsonrpc", "2.0"}, {"method", method}, {"params", params}});
}

}  // namespace thermbal::json_rpc
