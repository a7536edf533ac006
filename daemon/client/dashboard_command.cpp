#include "dashboard_command.hpp"

#include <csignal>
#include <thread>

#include <fmt/format.h>

#include "dashboard/server.hpp"
#include "output.hpp"

namespace thermbal {
namespace {

Result<DashboardOptions> options_of(const DashboardCommand& command) {
    auto address = parse_listen_address(command.listen);
    if (!address) return std::unexpected(address.error());
    if (!address->is_loopback() && !(command.beyond_this_machine && !command.token_file.empty())) {
        return fail(
            NextStep::refuse_input,
            fmt::format(
                "--listen {}: others than this machine could read it; give --beyond-this-machine and a "
                "--token-file with it if that is meant",
                command.listen));
    }
    std::string token;
    if (!command.token_file.empty()) {
        auto read = read_token(command.token_file);
        if (!read) return std::unexpected(read.error());
        token = std::move(*read);
    }
    DashboardOptions options;
    options.access = access_for(*address, command.hosts, std::move(token));
    options.address = std::move(*address);
    options.most_readers = command.most_readers;
    return options;
}

/// Signals that end the program, taken by wait_for_end alone. Before any thread is started.
sigset_t hold_ending_signals() {
    sigset_t ending;
    sigemptyset(&ending);
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) sigaddset(&ending, signal);
    pthread_sigmask(SIG_BLOCK, &ending, nullptr);
    return ending;
}

}  // namespace

int run_dashboard(const DashboardCommand& command) {
    const auto options = options_of(command);
    if (!options) return report_error(options.error());
    LiveState state(command.socket);
    if (const auto opened = state.open(); !opened)
        return report_error({NextStep::stop, opened.error().message});
    const sigset_t ending = hold_ending_signals();
    auto server = DashboardServer::open(*options, state);
    if (!server) return report_error(server.error());
    const bool is_v6 = options->address.host.find(':') != std::string::npos;
    if (const int failed = print_text(
            fmt::format("http://{}:{}/\n", is_v6 ? "[" + options->address.host + "]" : options->address.host,
                        server->port()));
        failed != 0)
        return failed;
    const std::jthread follower([&state](const std::stop_token& stop) { state.follow(stop); });
    const std::jthread serving([&server] { server->run(); });
    int signal = 0;
    sigwait(&ending, &signal);
    server->stop();
    return 0;
}

}  // namespace thermbal
