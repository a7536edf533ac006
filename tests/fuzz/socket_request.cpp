// What a client sends to the daemon's socket: the server takes it, answers every line with one JSON document,
// and is there for the next client.
#include <cstdint>
#include <filesystem>
#include <string>

#include <nlohmann/json.hpp>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "check.hpp"
#include "service/socket_server.hpp"

namespace {

using namespace thermbal;
using nlohmann::json;

const std::string& socket_path() {
    static const std::string path =
        (std::filesystem::temp_directory_path() / ("thermbal-fuzz-" + std::to_string(getpid()))).string();
    return path;
}

SocketServer make_server() {
    // Every request is to be answered at once: how many a client may send in 50 ms is tested elsewhere.
    auto opened = SocketServer::open({.path = socket_path(),
                                      .operators_group = "",
                                      .max_request_bytes = 4096,
                                      .max_requests_per_50_ms = std::size_t{1} << 20});
    FUZZ_CHECK(opened);
    SocketServer server = std::move(*opened);
    const auto echo = [](const Request& request) -> Result<json> {
        if (request.params.contains("fail")) return fail(NextStep::retry, "asked to fail");
        return request.params;
    };
    server.add_method("status", Access::reads, echo);
    server.add_method("stop_test", Access::changes, echo);
    server.add_topics({"event", "scan"});
    return server;
}

int connect_client() {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    socket_path().copy(address.sun_path, sizeof address.sun_path - 1);
    const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK, 0);
    FUZZ_CHECK(connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0);
    return fd;
}

void serve_what_is_ready(SocketServer& server) {
    for (int round = 0; round < 16; ++round) {
        pollfd ready{.fd = server.fd(), .events = POLLIN, .revents = 0};
        if (poll(&ready, 1, 0) <= 0) return;
        server.dispatch();
    }
}

std::string replies(int client) {
    std::string text;
    char block[4096];
    for (ssize_t got = 0; (got = read(client, block, sizeof block)) > 0;) {
        text.append(block, static_cast<std::size_t>(got));
    }
    return text;
}

void check_replies(const std::string& text) {
    for (std::size_t at = 0; at < text.size();) {
        const std::size_t end = text.find('\n', at);
        FUZZ_CHECK(end != std::string::npos);
        const json reply = json::parse(text.substr(at, end - at), nullptr, false);
        FUZZ_CHECK(reply.is_object() && reply.value("jsonrpc", "") == "2.0");
        FUZZ_CHECK(reply.contains("result") != reply.contains("error") || reply.contains("method"));
        at = end + 1;
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static SocketServer server = make_server();
    const int client = connect_client();
    const ssize_t sent = send(client, data, size, MSG_NOSIGNAL);
    serve_what_is_ready(server);
    const bool whole = sent == static_cast<ssize_t>(size);
    check_replies(replies(client));
    constexpr std::string_view ask = "\n{\"jsonrpc\":\"2.0\",\"id\":\"last\",\"method\":\"status\"}\n";
    if (whole && size < 2000 && send(client, ask.data(), ask.size(), MSG_NOSIGNAL) > 0) {
        serve_what_is_ready(server);
        const std::string answer = replies(client);
        check_replies(answer);
        FUZZ_CHECK(answer.contains("\"id\":\"last\""));
    }
    close(client);
    serve_what_is_ready(server);
    return 0;
}
