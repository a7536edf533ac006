#include <filesystem>
#include <memory>

#include <fmt/format.h>
#include <httplib.h>

#include "ask.hpp"
#include "commands.hpp"
#include "dashboard/access.hpp"
#include "dashboard/exclusive_port.hpp"
#include "files.hpp"
#include "metrics.hpp"
#include "output.hpp"
#include "socket_client.hpp"

namespace thermbal {
namespace {

struct MetricsFlags {
    std::string socket = default_socket;
    std::string textfile;
    std::string listen;
};

Result<std::string> ask_for_metrics(const std::string& socket) {
    auto client = SocketClient::connect(socket);
    if (!client) return std::unexpected(client.error());
    DaemonAnswers answers;
    for (const auto& [method, answer] : {std::pair{"status", &answers.status},
                                         {"channels", &answers.channels},
                                         {"health", &answers.health}}) {
        auto asked = client->ask(method);
        if (!asked) return std::unexpected(asked.error());
        *answer = std::move(*asked);
    }
    return prometheus_text(answers);
}

/// node_exporter reads whatever is there: the file is whole at every moment.
Result<void> replace_file(const std::string& path, const std::string& content) {
    const std::string fresh = path + ".new";
    if (auto written = write_file(fresh, content); !written) return written;
    std::error_code error;
    std::filesystem::rename(fresh, path, error);
    if (error) return fail(NextStep::stop, fmt::format("{}: {}", path, error.message()));
    return {};
}

int print_metrics(const MetricsFlags& flags) {
    const auto text = ask_for_metrics(flags.socket);
    const std::string content = text ? *text : prometheus_text_of_nobody();
    int status = 0;
    if (flags.textfile.empty())
        status = print_text(content);
    else if (const auto written = replace_file(flags.textfile, content); !written)
        return report_error(written.error());
    return text ? status : report_error({NextStep::stop, text.error().message});
}

/// Readings of a machine are for the machine's own host; a proxy in front of it may decide otherwise.
Result<ListenAddress> loopback_address(const std::string& text) {
    auto address = parse_listen_address(text);
    if (!address || !address->is_loopback() || address->port < 1)
        return fail(
            NextStep::refuse_input,
            fmt::format("--listen: found \"{}\"; accepted: 127.0.0.1:PORT, [::1]:PORT or localhost:PORT; "
                        "put a web server in front of it for others",
                        text));
    return address;
}

int serve_metrics(const MetricsFlags& flags) {
    const auto address = loopback_address(flags.listen);
    if (!address) return report_error(address.error());
    httplib::Server server;
    server.set_socket_options(keep_port_alone);
    server.Get("/metrics", [&](const httplib::Request&, httplib::Response& response) {
        response.set_content(ask_for_metrics(flags.socket).value_or(prometheus_text_of_nobody()),
                             "text/plain; version=0.0.4");
    });
    if (server.listen(address->host, address->port)) return 0;
    return report_error(
        {NextStep::stop, fmt::format("{}: cannot listen there; is something else on it?", flags.listen)});
}

}  // namespace

void add_metrics_command(CLI::App& app, int& status) {
    CLI::App& command = *app.add_subcommand("metrics", "the daemon's figures in Prometheus' text format");
    command.group("Ask a running daemon");
    const auto flags = std::make_shared<MetricsFlags>();
    command.add_option("--socket", flags->socket, "the daemon's Unix socket")
        ->capture_default_str()
        ->envname("THERMBAL_SOCKET");
    auto* textfile =
        command.add_option("--textfile", flags->textfile,
                           "write into this file, whole at every moment (node_exporter's textfile "
                           "collector)");
    command.add_option("--listen", flags->listen, "answer http://127.0.0.1:PORT/metrics until interrupted")
        ->excludes(textfile);
    command.footer("Without a daemon: thermbal_up 0, and status 1.");
    command.callback(
        [&status, flags] { status = flags->listen.empty() ? print_metrics(*flags) : serve_metrics(*flags); });
}

}  // namespace thermbal
