#include "live_feed.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "fields.hpp"

namespace thermbal {
namespace {

using nlohmann::json;
using std::chrono::duration;
using std::chrono::milliseconds;

constexpr auto answer_limit = std::chrono::seconds(3);
constexpr auto retry_after = std::chrono::seconds(1);
constexpr std::size_t most_events = 200;

}  // namespace

Result<void> LiveFeed::open() {
    auto client = SocketClient::connect(socket_);
    if (!client) return std::unexpected(client.error());
    client_ = std::move(*client);
    if (auto filled = fill(); !filled) {
        client_.reset();
        return filled;
    }
    return {};
}

Result<void> LiveFeed::fill() {
    // Subscribed first: a scan between the two comes twice rather than not at all.
    if (auto subscribed = client_->subscribe({"scan", "predictions", "event", "status", "comparison"});
        !subscribed)
        return subscribed;
    auto status = client_->ask("status", json::object(), answer_limit);
    if (!status) return std::unexpected(status.error());
    auto channels = client_->ask("channels", json::object(), answer_limit);
    if (!channels) return std::unexpected(channels.error());
    older_ = client_->kept();
    auto events = client_->ask("events", {{"limit", most_events}}, answer_limit);
    if (!events) return std::unexpected(events.error());
    scene_.status = std::move(*status);
    scene_.channels = std::move(*channels);
    scene_.events.clear();
    for (const json& event : list(*events, "events")) scene_.events.push_back(event);
    scanned_at_.reset();
    if (const auto age_s = number(scene_.status, "last_scan_age_s")) {
        scanned_at_ = Clock::now() -
                      std::chrono::duration_cast<Clock::duration>(duration<double>(std::max(0.0, *age_s)));
    }
    return {};
}

void LiveFeed::lose(const Error& error) {
    client_.reset();
    lost_at_ = tried_at_ = Clock::now();
    trouble_ = error.message;
}

Result<json> LiveFeed::ask(const char* method, const json& params) {
    if (!client_) return fail(NextStep::reopen_link, trouble_);
    auto answer = client_->ask(method, params, answer_limit);
    if (!answer && answer.error().next == NextStep::reopen_link) lose(answer.error());
    return answer;
}

bool LiveFeed::refresh(json& target, const char* method, const json& params) {
    auto answer = ask(method, params);
    if (answer) target = std::move(*answer);
    return answer.has_value();
}

void LiveFeed::refresh_curve() {
    scene_.curve = json();
    const json& channels = list(scene_.channels, "channels");
    const std::size_t chosen = scene_.chosen.value_or(0);
    json curves;
    if (chosen >= channels.size() ||
        !refresh(curves, "curve", {{"channel", text(channels[chosen], "channel")}}))
        return;
    const json& found = list(curves, "curves");
    if (!found.empty()) scene_.curve = found.front();
}

void LiveFeed::take_event(const json& event) {
    const auto id = number(event, "id").value_or(0.0);
    const bool is_known = id > 0 && std::ranges::any_of(scene_.events, [&](const json& kept) {
                              return number(kept, "id") == id;
                          });
    if (is_known) return;
    scene_.events.push_back(event);
    if (scene_.events.size() > most_events) scene_.events.pop_front();
}

void LiveFeed::take(const Notification& notification) {
    if (notification.topic == "scan") {
        scene_.channels = notification.params;
        scanned_at_ = Clock::now();
    } else if (notification.topic == "status") {
        scene_.status = notification.params;
    } else if (notification.topic == "event") {
        take_event(notification.params);
    }
}

std::vector<Notification> LiveFeed::update() {
    std::vector<Notification> taken;
    if (!client_ && Clock::now() - tried_at_ >= retry_after) {
        tried_at_ = Clock::now();
        if (open()) trouble_.clear();
    }
    bool scanned = false;
    bool identified = false;
    while (client_) {
        auto next = client_->next(milliseconds(0));
        if (!next) lose(next.error());
        if (!next || !*next) break;
        const bool is_older = older_ > 0;
        if (is_older) --older_;
        if (is_older && (*next)->topic != "event") continue;
        take(**next);
        scanned = scanned || (*next)->topic == "scan";
        // The figures of a comparison are of the scan before it, and stand in its channels.
        identified = identified || (*next)->topic == "predictions" || (*next)->topic == "comparison";
        taken.push_back(std::move(**next));
    }
    // Neither the state nor, after an identification, the verdicts are in the notifications.
    if (scanned || identified) refresh(scene_.status, "status");
    if (identified) refresh(scene_.channels, "channels");
    if (identified && scene_.page == WatchScene::Page::channel) refresh_curve();
    return taken;
}

WatchScene& LiveFeed::scene() {
    scene_.scan_age_s.reset();
    if (scanned_at_) scene_.scan_age_s = duration<double>(Clock::now() - *scanned_at_).count();
    scene_.trouble.clear();
    if (!client_) {
        scene_.trouble = fmt::format("thermbald is away for {:.0f} s, these figures are old; reconnecting",
                                     duration<double>(Clock::now() - lost_at_).count());
    }
    return scene_;
}

}  // namespace thermbal
