#include "watch.hpp"

#include <algorithm>
#include <array>
#include <csignal>

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include "answers.hpp"
#include "fields.hpp"
#include "live_feed.hpp"
#include "output.hpp"
#include "terminal.hpp"

namespace thermbal {
namespace {

using nlohmann::json;
using Page = WatchScene::Page;

int report_not_there(Error error) {
    if (error.next == NextStep::refuse_input) error.next = NextStep::stop;
    return report_error(error);
}

// ---- a pipe ----

int print_notification(const Notification& notification, const WatchScene& scene, bool as_json) {
    if (as_json) return print_json_line({{"topic", notification.topic}, {"params", notification.params}});
    if (notification.topic == "scan") return print_text(scan_line(notification.params, scene.status) + "\n");
    if (notification.topic == "event")
        return print_text(event_time(notification.params) + " " + event_message(notification.params) + "\n");
    return 0;
}

int print_newest_scan(const WatchScene& scene, bool as_json) {
    return print_notification({"scan", scene.channels}, scene, as_json);
}

int watch_as_lines(LiveFeed& feed, bool as_json) {
    const auto say = [](std::string_view what) { fmt::print(stderr, "thermbalctl: {}\n", what); };
    int failed = print_newest_scan(feed.scene(), as_json);
    while (failed == 0) {
        std::array<pollfd, 2> waiting{{{feed.fd(), POLLIN, 0}, {STDOUT_FILENO, 0, 0}}};
        poll(waiting.data(), waiting.size(), feed.pending() ? 0 : feed.connected() ? -1 : 1000);
        if ((waiting[1].revents & POLLERR) != 0) return 0;  // whoever read the lines has gone
        const bool was_connected = feed.connected();
        const auto taken = feed.update();
        if (!was_connected && feed.connected()) {
            say("connected again");
            failed = print_newest_scan(feed.scene(), as_json);
        }
        for (const Notification& notification : taken) {
            if (failed == 0) failed = print_notification(notification, feed.scene(), as_json);
        }
        if (was_connected && !feed.connected()) say(feed.trouble() + "; reconnecting");
    }
    return failed;
}

// ---- a terminal ----

enum class Key { none, quit, up, down, page_up, page_down, enter, back, events, help };

/// The next key of what was typed; escape sequences of the arrow keys are one key.
Key take_key(std::string_view& typed) {
    constexpr std::array<std::pair<std::string_view, Key>, 21> keys = {
        {{"\x1b[A", Key::up},       {"\x1bOA", Key::up},   {"k", Key::up},
         {"\x1b[B", Key::down},     {"\x1bOB", Key::down}, {"j", Key::down},
         {"\r", Key::enter},        {"\n", Key::enter},    {"q", Key::quit},
         {"Q", Key::quit},          {"\x04", Key::quit},   {"e", Key::events},
         {"\x7f", Key::back},       {"\b", Key::back},     {"c", Key::back},
         {"\x1b[5~", Key::page_up}, {"b", Key::page_up},   {"\x1b[6~", Key::page_down},
         {" ", Key::page_down},     {"?", Key::help},      {"h", Key::help}}};
    for (const auto& [bytes, key] : keys) {
        if (!typed.starts_with(bytes)) continue;
        typed.remove_prefix(bytes.size());
        return key;
    }
    const bool is_escape_alone = typed == "\x1b";
    const bool is_sequence = typed.size() > 1 && typed.front() == '\x1b';
    // An unknown escape sequence is passed over whole: its letters are no keys.
    const std::size_t end = is_sequence ? typed.find_first_of("ABCDEFGHPQRSZ~", 2) : 0;
    typed.remove_prefix(end == std::string_view::npos ? typed.size() : end + 1);
    return is_escape_alone ? Key::back : Key::none;
}

bool shows_channels(const WatchScene& scene) {
    return scene.page == Page::channels || scene.page == Page::channel;
}

void scroll_events(WatchScene& scene, bool back, std::size_t count) {
    if (scene.page != Page::events) return;
    const std::size_t most = scene.events.empty() ? 0 : scene.events.size() - 1;
    scene.events_back = back ? std::min(scene.events_back + count, most)
                             : scene.events_back - std::min(scene.events_back, count);
}

/// False when the view is to be left.
bool press(Key key, LiveFeed& feed) {
    constexpr std::size_t events_a_page = 10;
    WatchScene& scene = feed.scene();
    const std::size_t channels = list(scene.channels, "channels").size();
    switch (key) {
        case Key::none:
            return true;
        case Key::quit:
            return false;
        case Key::events:
            scene.page = scene.page == Page::events ? Page::channels : Page::events;
            scene.events_back = 0;
            return true;
        case Key::help:
            scene.page = scene.page == Page::help ? Page::channels : Page::help;
            return true;
        case Key::enter:
            if (!shows_channels(scene) || channels == 0) return true;
            scene.page = Page::channel;
            scene.chosen = scene.chosen.value_or(0);
            break;
        case Key::back:
            if (scene.page == Page::channels) scene.chosen.reset();
            scene.page = Page::channels;
            return true;
        case Key::page_up:
        case Key::page_down:
            scroll_events(scene, key == Key::page_up, events_a_page);
            return true;
        case Key::up:
        case Key::down:
            scroll_events(scene, key == Key::up, 1);
            if (!shows_channels(scene) || channels == 0) return true;
            if (!scene.chosen) {
                scene.chosen = key == Key::down ? 0 : channels - 1;
            } else {
                scene.chosen = (*scene.chosen + (key == Key::down ? 1 : channels - 1)) % channels;
            }
            break;
    }
    if (scene.page == Page::channel) feed.refresh_curve();
    return true;
}

bool take_keys(LiveFeed& feed) {
    std::array<char, 256> buffer;
    const ssize_t got = read(STDIN_FILENO, buffer.data(), buffer.size());
    if (got <= 0) return false;
    std::string_view typed(buffer.data(), static_cast<std::size_t>(got));
    while (!typed.empty()) {
        if (!press(take_key(typed), feed)) return false;
    }
    return true;
}

/// 0, or the signal that ends the view.
int take_signals(Terminal& terminal) {
    for (int signal = terminal.take_signal(); signal != 0; signal = terminal.take_signal()) {
        if (signal == SIGTSTP) {
            terminal.suspend();
        } else if (signal != SIGWINCH) {
            return signal;
        }
    }
    return 0;
}

int watch_on(Terminal& terminal, LiveFeed& feed, const OutputStyle& style) {
    constexpr int tick_ms = 1000;       // the ages on the screen go on
    constexpr int least_frame_ms = 40;  // a test in accelerated time sends more scans than anybody can read
    using Clock = std::chrono::steady_clock;
    Clock::time_point shown_at{};
    for (;;) {
        const auto since_ms =
            std::chrono::duration_cast<std::chrono::milliseconds>(Clock::now() - shown_at).count();
        if (since_ms < least_frame_ms) poll(nullptr, 0, static_cast<int>(least_frame_ms - since_ms));
        feed.update();
        terminal.show(render_frame(feed.scene(), terminal.size(), {style.colour, style.unicode}));
        shown_at = Clock::now();
        std::array<pollfd, 3> waiting{
            {{feed.fd(), POLLIN, 0}, {terminal.key_fd(), POLLIN, 0}, {terminal.signal_fd(), POLLIN, 0}}};
        poll(waiting.data(), waiting.size(), feed.pending() ? 0 : tick_ms);
        if (waiting[1].revents != 0 && !take_keys(feed)) return 0;
        if (const int signal = take_signals(terminal); signal != 0) return signal;
    }
}

int watch_in_terminal(LiveFeed& feed, const OutputStyle& style) {
    int signal = 0;
    {
        auto terminal = Terminal::open();
        if (!terminal) return report_error(terminal.error());
        signal = watch_on(*terminal, feed, style);
    }
    // What the shell expects of a program that a signal ended, now that the terminal is given back.
    return signal == 0 ? 0 : 128 + signal;
}

}  // namespace

int run_watch(const AskOptions& ask) {
    LiveFeed feed(ask.socket);
    if (const auto opened = feed.open(); !opened) return report_not_there(opened.error());
    const OutputStyle style = output_style();
    return style.is_terminal && !ask.json ? watch_in_terminal(feed, style) : watch_as_lines(feed, ask.json);
}

}  // namespace thermbal
