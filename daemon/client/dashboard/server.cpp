#include "server.hpp"

#include <atomic>
#include <chrono>
#include <memory>
#include <string_view>
#include <thread>

#include <fmt/format.h>
#include <httplib.h>

#include "exclusive_port.hpp"
#include "report/assets.hpp"

namespace thermbal {
namespace {

constexpr auto heartbeat = std::chrono::seconds(5);  // so that a reader who has gone is noticed
constexpr auto breath =
    std::chrono::milliseconds(250);  // a test in accelerated time scans faster than anybody reads
constexpr char cookie_name[] = "thermbal_token=";

/// Nothing from elsewhere is ever loaded, embedded or asked. dygraphs places its labels by style attributes;
/// scripts and style sheets are the server's own files only.
constexpr char content_policy[] =
    "default-src 'none'; script-src 'self'; style-src 'self'; style-src-attr 'unsafe-inline'; "
    "img-src 'self' data:; connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

std::string cookie_in(const httplib::Request& request) {
    const std::string cookies = request.get_header_value("Cookie");
    const std::size_t at = cookies.find(cookie_name);
    if (at == std::string::npos) return {};
    const std::size_t from = at + std::string_view(cookie_name).size();
    return cookies.substr(from, cookies.find(';', from) - from);
}

std::string token_in(const httplib::Request& request) {
    constexpr std::string_view bearer = "Bearer ";
    const std::string authorization = request.get_header_value("Authorization");
    if (authorization.starts_with(bearer)) return authorization.substr(bearer.size());
    return cookie_in(request);
}

void refuse(httplib::Response& response, int status, std::string_view why) {
    response.status = status;
    response.set_content(std::string(why) + "\n", "text/plain; charset=utf-8");
}

/// A message of the event stream of HTML: `data` has no line's end in it.
std::string as_event(const std::string& data) {
    return "data: " + data + "\n\n";
}

}  // namespace

struct DashboardServer::Parts {
    Parts(DashboardOptions wanted, LiveState& followed) : options(std::move(wanted)), state(followed) {}

    DashboardOptions options;
    LiveState& state;
    httplib::Server server;
    int port = 0;
    std::atomic<std::size_t> readers = 0;
    std::atomic<bool> stopping = false;

    httplib::Server::HandlerResponse admit(const httplib::Request& request,
                                           httplib::Response& response) const;
    void serve_assets();
    void serve_live();
};

/// Who is not let in gets no more than that.
httplib::Server::HandlerResponse DashboardServer::Parts::admit(const httplib::Request& request,
                                                               httplib::Response& response) const {
    using Handled = httplib::Server::HandlerResponse;
    if (request.method != "GET" && request.method != "HEAD") {
        refuse(response, 405, "this dashboard only reads");
        return Handled::Handled;
    }
    if (!options.access.allows_host(request.get_header_value("Host"))) {
        refuse(response, 421,
               "unknown host name: name it with --host where thermbalctl dashboard is started");
        return Handled::Handled;
    }
    if (options.access.token.empty() || options.access.allows_token(token_in(request)))
        return Handled::Unhandled;
    if (request.path == "/" && options.access.allows_token(request.get_param_value("token"))) {
        // Into a cookie and out of the address, where it would stay in histories.
        response.set_header("Set-Cookie", fmt::format("{}{}; HttpOnly; SameSite=Strict; Path=/", cookie_name,
                                                      options.access.token));
        response.set_redirect("/");
        return Handled::Handled;
    }
    refuse(response, 401, "open /?token=... with the token of --token-file once");
    return Handled::Handled;
}

void DashboardServer::Parts::serve_assets() {
    const auto asset = [this](const char* path, std::string_view content, const char* type) {
        server.Get(path, [content, type](const httplib::Request&, httplib::Response& response) {
            response.set_content(content.data(), content.size(), type);
        });
    };
    asset("/", dashboard_html(), "text/html; charset=utf-8");
    asset("/dashboard.js", dashboard_js(), "text/javascript; charset=utf-8");
    asset("/plots.js", plots_js(), "text/javascript; charset=utf-8");
    asset("/dygraph.js", dygraphs_js(), "text/javascript; charset=utf-8");
    asset("/dygraph.css", dygraphs_css(), "text/css; charset=utf-8");
    asset("/page.css", page_css(), "text/css; charset=utf-8");
}

void DashboardServer::Parts::serve_live() {
    server.Get("/live", [this](const httplib::Request&, httplib::Response& response) {
        if (readers.fetch_add(1) >= options.most_readers) {
            --readers;
            response.set_header("Retry-After", "10");
            return refuse(response, 503, "too many pages are open");
        }
        const auto seen = std::make_shared<LiveState::Seen>();
        response.set_chunked_content_provider(
            "text/event-stream",
            [this, seen](std::size_t, httplib::DataSink& sink) {
                const auto message = state.next(*seen, heartbeat);
                if (stopping) return false;
                const std::string text = message ? as_event(*message) : ": still here\n\n";
                if (!sink.write(text.data(), text.size())) return false;
                std::this_thread::sleep_for(breath);
                return true;
            },
            [this](bool) { --readers; });
    });
}

DashboardServer::DashboardServer(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}
DashboardServer::DashboardServer(DashboardServer&&) noexcept = default;
DashboardServer& DashboardServer::operator=(DashboardServer&&) noexcept = default;
DashboardServer::~DashboardServer() = default;

Result<DashboardServer> DashboardServer::open(const DashboardOptions& options, LiveState& state) {
    auto parts = std::make_unique<Parts>(options, state);
    httplib::Server& server = parts->server;
    // A reader holds a thread; a few more answer everything else, so that readers cannot lock the page out.
    constexpr std::size_t threads_for_the_rest = 4;
    const std::size_t threads = options.most_readers + threads_for_the_rest;
    server.new_task_queue = [threads] { return new httplib::ThreadPool(threads); };
    server.set_keep_alive_timeout(2);
    server.set_read_timeout(5);
    server.set_write_timeout(5);
    server.set_payload_max_length(0);
    server.set_default_headers({{"Content-Security-Policy", content_policy},
                                {"X-Content-Type-Options", "nosniff"},
                                {"Referrer-Policy", "no-referrer"},
                                {"Cross-Origin-Resource-Policy", "same-origin"},
                                {"Cache-Control", "no-store"}});
    server.set_pre_routing_handler(
        [raw = parts.get()](const httplib::Request& request, httplib::Response& response) {
            return raw->admit(request, response);
        });
    server.set_socket_options(keep_port_alone);
    parts->serve_assets();
    parts->serve_live();
    const auto& [host, port] = options.address;
    parts->port = port == 0 ? server.bind_to_any_port(host) : server.bind_to_port(host, port) ? port : -1;
    if (parts->port < 0)
        return fail(NextStep::stop,
                    fmt::format("{}:{}: cannot listen there; is something else on it?", host, port));
    return DashboardServer(std::move(parts));
}

int DashboardServer::port() const {
    return parts_->port;
}

void DashboardServer::run() {
    parts_->server.listen_after_bind();
}

void DashboardServer::stop() {
    parts_->stopping = true;
    parts_->state.close();
    parts_->server.stop();
}

}  // namespace thermbal
