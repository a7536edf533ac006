#include "live_state.hpp"

#include <array>
#include <cmath>
#include <limits>

#include <poll.h>

#include "fields.hpp"
#include "report/page.hpp"
#include "report/plot.hpp"
#include "report/verdict_json.hpp"
#include "samples.hpp"
#include "series/sample.hpp"

namespace thermbal {
namespace {

using nlohmann::json;
using std::chrono::milliseconds;

double good_value_C(const json& sample) {
    return text(sample, "quality") == "good" ? number(sample, "value_C").value_or(no_value) : no_value;
}

/// A reader that is further behind gets the whole course, thinned.
constexpr std::size_t most_rows = 500;

}  // namespace

void LiveState::follow(const std::stop_token& stop) {
    bool was_connected = false;
    publish();
    while (!stop.stop_requested()) {
        std::array<pollfd, 1> waiting{{{feed_.fd(), POLLIN, 0}}};
        constexpr int longest_ms = 200;
        if (!feed_.pending()) poll(waiting.data(), waiting.size(), longest_ms);
        const auto taken = feed_.update();
        const bool is_back = feed_.connected() && !was_connected;
        const bool is_away = was_connected && !feed_.connected();
        was_connected = feed_.connected();
        if (is_back) refill();
        if (!taken.empty()) take(taken);
        if (is_back || is_away || !taken.empty()) publish();
    }
}

void LiveState::take(const std::vector<Notification>& notifications) {
    const auto id = number(object_in(feed_.scene().status, "test"), "id");
    if (id && static_cast<std::int64_t>(*id) != test_) return refill();
    for (const Notification& notification : notifications) {
        if (notification.topic == "scan") take_scan(notification.params);
        if (notification.topic == "predictions") {
            if (auto answer = feed_.ask("predictions")) predictions_ = list(*answer, "channels");
        }
    }
}

void LiveState::take_scan(const json& channels) {
    const auto time_min = number(channels, "time_min");
    const std::lock_guard lock(mutex_);
    if (!time_min || (!time_min_.empty() && *time_min <= time_min_.back())) return;
    const json& samples = list(channels, "channels");
    if (samples.size() != names_.size()) return;
    time_min_.push_back(*time_min);
    for (std::size_t i = 0; i < names_.size(); ++i) columns_[i].push_back(good_value_C(samples[i]));
}

/// The course of the test from its first scan on, out of the daemon's store.
void LiveState::refill() {
    const auto id = number(object_in(feed_.scene().status, "test"), "id");
    std::vector<std::string> names;
    for (const json& channel : list(feed_.scene().channels, "channels"))
        names.push_back(text(channel, "channel"));
    std::vector<double> time_min;
    std::vector<std::vector<double>> columns(names.size());
    const auto take_page = [&](const json& page) {
        for (const json& scan : list(page, "scans")) {
            time_min.push_back(number(scan, "time_s").value_or(no_value) / 60.0);
            for (std::size_t i = 0; i < names.size(); ++i)
                columns[i].push_back(good_value_C(object_in(object_in(scan, "samples"), names[i].c_str())));
        }
    };
    // Whoever breaks off is away: what came is shown until it is back.
    if (id) {
        (void)ask_samples([&](const json& params) { return feed_.ask("samples", params); },
                          {{"from_scan", 0}}, std::numeric_limits<std::int64_t>::max(), take_page);
    }
    predictions_ = json::array();
    if (auto answer = feed_.ask("predictions")) predictions_ = list(*answer, "channels");
    const std::lock_guard lock(mutex_);
    test_ = id ? static_cast<std::int64_t>(*id) : -1;
    names_ = std::move(names);
    time_min_ = std::move(time_min);
    columns_ = std::move(columns);
    ++refills_;
}

void LiveState::publish() {
    const WatchScene& now = feed_.scene();
    json events = json::array();
    for (const json& event : now.events) events.push_back(event);
    json scene = {{"status", now.status},
                  {"channels", list(now.channels, "channels")},
                  {"predictions", predictions_},
                  {"events", std::move(events)},
                  {"trouble", now.trouble}};
    const std::lock_guard lock(mutex_);
    scene_ = std::move(scene);
    ++version_;
    changed_.notify_all();
}

json LiveState::history() const {
    PlotTable table{"course", "min", time_min_, {}};
    for (std::size_t i = 0; i < names_.size(); ++i) table.columns.push_back({names_[i], columns_[i]});
    json made = table_to_json(thinned(std::move(table), pixels_of_a_screen));
    made["names"] = names_;
    return made;
}

std::optional<std::string> LiveState::next(Seen& seen, milliseconds limit) {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, limit, [&] { return closed_ || version_ != seen.version; });
    if (closed_ || version_ == seen.version) return std::nullopt;
    json message = scene_;
    if (seen.refills != refills_ || seen.rows > time_min_.size() ||
        time_min_.size() - seen.rows > most_rows) {
        message["history"] = history();
    } else {
        json rows = json::array();
        for (std::size_t row = seen.rows; row < time_min_.size(); ++row) {
            json values = json::array({time_min_[row]});
            for (const auto& column : columns_) values.push_back(number_or_null(column[row]));
            rows.push_back(std::move(values));
        }
        message["rows"] = std::move(rows);
    }
    seen = {version_, refills_, time_min_.size()};
    lock.unlock();
    return message.dump(-1, ' ', false, json::error_handler_t::replace);
}

void LiveState::close() {
    const std::lock_guard lock(mutex_);
    closed_ = true;
    changed_.notify_all();
}

}  // namespace thermbal
