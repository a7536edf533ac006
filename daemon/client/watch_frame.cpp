#include "watch_frame.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "answers.hpp"
#include "channel_columns.hpp"
#include "columns.hpp"
#include "fields.hpp"
#include "frame_line.hpp"
#include "plots.hpp"

namespace thermbal {
namespace {

using nlohmann::json;

/// The lines of one screen, top down.
class Frame {
  public:
    Frame(FrameSize size, FrameLook look) : size_(size), look_(look) {}

    FrameLine line() const { return {size_.columns, look_.colour}; }
    void put(const FrameLine& made) {
        if (lines_.size() < size_.rows) lines_.push_back(made.str());
    }
    void put(std::string_view text, Ink ink = Ink::plain) {
        FrameLine made = line();
        made.add(text, ink);
        put(made);
    }
    /// Fills up, so that the next line is the last.
    void down_to_last() { lines_.resize(std::max<std::size_t>(size_.rows, 1) - 1); }
    std::size_t rows_left() const { return size_.rows - lines_.size(); }
    std::size_t columns() const { return size_.columns; }
    bool unicode() const { return look_.unicode; }
    std::string str() {
        lines_.resize(size_.rows);
        return fmt::format("{}", fmt::join(lines_, "\n"));
    }

  private:
    FrameSize size_;
    FrameLook look_;
    std::vector<std::string> lines_;
};

std::string repeated(std::string_view text, std::size_t count) {
    std::string whole;
    for (std::size_t i = 0; i < count; ++i) whole += text;
    return whole;
}

void put_title(Frame& frame, const WatchScene& scene) {
    const json& test = object_in(scene.status, "test");
    std::string left = " thermbal";
    std::string right = text(scene.status, "state");
    if (!test.empty()) {
        left += fmt::format("  test {} \"{}\"", fixed(number(test, "id"), 0), text(test, "name"));
        right += fmt::format("  {} min  {} scans", fixed(number(test, "time_min"), 2),
                             fixed(number(test, "scans"), 0));
    }
    if (const std::string machine = text(scene.status, "machine"); !machine.empty())
        left += fmt::format("  {}", machine);
    right += " ";
    FrameLine title = frame.line();
    const std::size_t right_width = std::min(display_width(right), frame.columns());
    title.add(clipped(printable(left), frame.columns() - right_width), Ink::title);
    title.fill_to(frame.columns() - right_width, Ink::title);
    title.add(right, Ink::title);
    frame.put(title);
}

/// A scan that should have come by now; what is on the screen is then older than it looks.
bool is_overdue(const WatchScene& scene) {
    const double period_s = number(scene.status, "period_s").value_or(15.0);
    return scene.scan_age_s && *scene.scan_age_s > std::max(2.5 * period_s, 5.0);
}

void put_summary(Frame& frame, const WatchScene& scene) {
    const json& test = object_in(scene.status, "test");
    FrameLine summary = frame.line();
    if (!scene.trouble.empty()) {
        summary.add(fmt::format(" {}", scene.trouble), Ink::bad);
    } else if (is_overdue(scene)) {
        summary.add(fmt::format(" no scan for {:.0f} s: see thermbalctl health", *scene.scan_age_s),
                    Ink::bad);
    } else if (test.empty()) {
        summary.add(" no test is running: thermbalctl start", Ink::warning);
    } else {
        constexpr std::size_t bar_columns = 12;
        const DeclaredCount count = count_declared(scene.channels);
        const std::size_t full = count.required > 0 ? bar_columns * count.declared / count.required : 0;
        const bool all = count.required > 0 && count.declared == count.required;
        summary.add(" declared ");
        summary.add(repeated(frame.unicode() ? "█" : "#", full), Ink::good);
        summary.add(repeated(frame.unicode() ? "░" : ".", bar_columns - full), Ink::dim);
        summary.add(fmt::format(" {} of {}   ", count.declared, count.required),
                    all ? Ink::good_bold : Ink::bold);
        summary.add(text(test, "reason"), text(scene.status, "state") == "aborted" ? Ink::bad : Ink::plain);
    }
    frame.put(summary);
}

void put_channel_row(Frame& frame, const std::vector<ChannelColumn>& columns, const json& channel,
                     bool is_chosen, bool is_old) {
    FrameLine row = frame.line();
    for (std::size_t i = 0; i < columns.size(); ++i) {
        const ChannelColumn& column = columns[i];
        const ChannelCell cell = column.cell(channel, column.width);
        if (i > 0) row.add(" ");
        const std::string safe = printable(cell.text);
        const Ink ink = is_chosen && i == 0 ? Ink::title : is_old ? Ink::dim : cell.ink;
        row.add(column.is_number ? right_aligned(safe, column.width) : left_aligned(safe, column.width), ink);
    }
    frame.put(row);
}

void put_channels(Frame& frame, const WatchScene& scene, std::size_t rows) {
    const json& channels = list(scene.channels, "channels");
    const std::vector<ChannelColumn> columns = fitting_columns(channels, frame.columns(), frame.unicode());
    FrameLine titles = frame.line();
    for (std::size_t i = 0; i < columns.size(); ++i) {
        if (i > 0) titles.add(" ");
        titles.add(columns[i].is_number ? right_aligned(columns[i].title, columns[i].width)
                                        : left_aligned(columns[i].title, columns[i].width),
                   Ink::dim);
    }
    frame.put(titles);
    const std::size_t chosen = scene.chosen.value_or(0);
    const std::size_t first = chosen >= rows && rows > 0 ? chosen - rows + 1 : 0;
    for (std::size_t i = first; i < std::min(channels.size(), first + rows); ++i) {
        put_channel_row(frame, columns, channels[i], scene.chosen == i, !scene.trouble.empty());
    }
}

Ink ink_of_event(const json& event) {
    const std::string kind = text(event, "kind");
    if (kind == "declared" || kind == "renewed" || kind == "all_declared" || kind == "stopped")
        return Ink::good;
    if (kind == "withdrawn" || kind == "aborted" || kind == "held" || kind.ends_with("trouble"))
        return Ink::bad;
    return Ink::plain;
}

/// The newest that fit, oldest first. A message that is too long for one line is clipped.
void put_events(Frame& frame, const WatchScene& scene, std::size_t rows) {
    const std::size_t back = scene.page == WatchScene::Page::events ? scene.events_back : 0;
    const std::size_t end = scene.events.size() - std::min(back, scene.events.size());
    const std::size_t count = std::min(rows, end);
    for (std::size_t i = end - count; i < end; ++i) {
        FrameLine line = frame.line();
        const Ink ink = ink_of_event(scene.events[i]);
        line.add(fmt::format("{:>10} ", event_time(scene.events[i])), ink == Ink::plain ? Ink::dim : ink);
        line.add(event_message(scene.events[i]), ink);
        frame.put(line);
    }
}

void put_rule(Frame& frame, std::string_view name) {
    FrameLine rule = frame.line();
    rule.add(frame.unicode() ? "─ " : "- ", Ink::dim);
    rule.add(name, Ink::dim);
    rule.add(" ");
    rule.add(repeated(frame.unicode() ? "─" : "-", rule.left()), Ink::dim);
    frame.put(rule);
}

void put_keys(Frame& frame, std::initializer_list<std::pair<std::string_view, std::string_view>> keys) {
    frame.down_to_last();
    FrameLine line = frame.line();
    for (const auto& [key, what] : keys) {
        line.add(" ");
        line.add(key, Ink::bold);
        line.add(fmt::format(" {} ", what), Ink::dim);
    }
    frame.put(line);
}

/// Where a chart's values are going: drawn behind the last of them to the right edge.
struct Goal {
    double low = NAN;
    double high = NAN;
};

/// Columns of blocks, `height` rows: values from `low` (nothing) to `high` (all rows), `step` columns each.
void put_chart(Frame& frame, const json& values, double low, double high, std::size_t height,
               std::size_t step, std::size_t marked, Goal goal = {}) {
    static constexpr std::array<std::string_view, 9> blocks = {" ", "▁", "▂", "▃", "▄", "▅", "▆", "▇", "█"};
    for (std::size_t row = height; row-- > 0;) {
        FrameLine line = frame.line();
        const bool top = row + 1 == height;
        line.add(top || row == 0 ? fmt::format("{:>8.2f} ", top ? high : low) : std::string(9, ' '),
                 Ink::dim);
        line.add(frame.unicode() ? "│" : "|", Ink::dim);
        for (std::size_t i = 0; i < values.size(); ++i) {
            const double value = values[i].is_number() ? values[i].get<double>() : std::nan("");
            const double eighths =
                (value - low) / std::max(high - low, 1e-9) * 8.0 * static_cast<double>(height) -
                8.0 * static_cast<double>(row);
            const double least = row == 0 ? 1.0 : 0.0;
            const auto level =
                std::isfinite(eighths) ? static_cast<std::size_t>(std::clamp(eighths, least, 8.0)) : 0;
            const std::string_view block = frame.unicode() ? blocks.at(level)
                                           : level >= 4    ? "#"
                                           : level > 0     ? "."
                                                           : " ";
            line.add(repeated(block, step > 1 ? step - 1 : 1) + (step > 1 ? " " : ""),
                     i == marked ? Ink::good_bold : Ink::plain);
        }
        const double row_high = (high - low) / static_cast<double>(height);
        const double from = low + row_high * static_cast<double>(row);
        if (goal.low <= from + row_high && goal.high >= from)
            line.add(repeated(frame.unicode() ? "░" : ":", line.left()), Ink::good);
        frame.put(line);
    }
}

struct Range {
    double low = INFINITY;
    double high = -INFINITY;
    std::size_t lowest = 0;
};

Range range_of(const json& values) {
    Range range;
    for (std::size_t i = 0; i < values.size(); ++i) {
        if (!values[i].is_number()) continue;
        const double value = values[i].get<double>();
        if (value < range.low) range.lowest = i;
        range.low = std::min(range.low, value);
        range.high = std::max(range.high, value);
    }
    return range;
}

std::size_t step_for(std::size_t count, std::size_t columns) {
    constexpr std::size_t axis_columns = 10;
    return std::clamp<std::size_t>(
        (columns - std::min(columns, axis_columns)) / std::max<std::size_t>(count, 1), 1, 4);
}

void put_recent(Frame& frame, const json& channel, std::size_t height) {
    const json& recent = list(channel, "recent_C");
    const Range range = range_of(recent);
    put_rule(frame, "temperature since the start, C; at the right where it settles, 90 %");
    if (!(range.low <= range.high)) return frame.put("  no good reading yet", Ink::dim);
    const Goal goal{number(channel, "steady_state_low_C").value_or(NAN),
                    number(channel, "steady_state_high_C").value_or(NAN)};
    // A goal far away says that nothing is known yet; it must not press the course flat.
    const bool near = goal.high <= range.high + 2.0 * (range.high - range.low);
    const double top = std::fmax(std::max(range.high, range.low + 0.5), near ? goal.high : NAN);
    constexpr std::size_t columns_for_goal = 10;
    put_chart(frame, recent, range.low, top, height,
              step_for(recent.size(), frame.columns() - std::min(frame.columns(), columns_for_goal)),
              recent.size(), near ? goal : Goal{});
}

void put_curve(Frame& frame, const json& curve, std::size_t height) {
    const json& rmse_C = list(curve, "rmse_by_n_C");
    const Range range = range_of(rmse_C);
    if (!(range.low <= range.high)) {
        put_rule(frame, "RMSE against n, C");
        return frame.put("  not swept on this window yet", Ink::dim);
    }
    put_rule(frame, fmt::format("RMSE against n, C: minimum {:.3f} at n = {}", range.low, range.lowest + 1));
    const std::size_t step = step_for(rmse_C.size(), frame.columns());
    put_chart(frame, rmse_C, 0.0, range.high, height, step, range.lowest);
    FrameLine axis = frame.line();
    axis.add(fmt::format("{:>10}", "n = "), Ink::dim);
    for (std::size_t n = 1; n <= rmse_C.size(); n = n == 1 ? 5 : n + 5) {
        axis.fill_to(10 + (n - 1) * step);
        axis.add(std::to_string(n), Ink::dim);
    }
    frame.put(axis);
}

void put_channel_facts(Frame& frame, const json& channel) {
    const auto fact = [&](std::string_view name, const std::string& value, Ink ink = Ink::plain) {
        FrameLine line = frame.line();
        line.add(fmt::format(" {:<10}", name), Ink::dim);
        line.add(value, ink);
        frame.put(line);
    };
    const bool declared = text(channel, "state") == "declared";
    const bool good = text(channel, "quality") == "good";
    fact("channel", fmt::format("{}  {}", text(channel, "channel"), text(channel, "place")), Ink::bold);
    // Rise and rate are of the readings that were good: not of now when the newest is not.
    const auto current = [&](const char* key) { return good ? number(channel, key) : std::nullopt; };
    fact("now",
         fmt::format("{}{}   rise {} C   {} C/h", value_or_quality(channel, false), good ? " C" : "",
                     with_sign(current("rise_C"), 2), with_sign(current("rate_C_per_h"), 1)),
         good ? Ink::plain : Ink::bad);
    fact("settles",
         fmt::format("{} C   90 % between {} and {} C", fixed(number(channel, "steady_state_C"), 2),
                     fixed(number(channel, "steady_state_low_C"), 2),
                     fixed(number(channel, "steady_state_high_C"), 2)),
         declared ? Ink::good_bold : Ink::plain);
    fact("95 %", fmt::format("at {}   {} left", minutes(number(channel, "equilibrium_time_min")),
                             minutes(number(channel, "time_left_min"))));
    if (const auto residual_C = number(channel, "residual_C")) {
        fact("simulated",
             fmt::format("{} C   measured is {} C off{}", fixed(number(channel, "simulated_C"), 2),
                         with_sign(residual_C, 2),
                         flag(channel, "disagrees") ? ": more than noise and model allow" : ""),
             flag(channel, "disagrees") ? Ink::bad : Ink::plain);
    }
    fact("state", state_name(channel) + (flag(channel, "required") ? "" : ", not required"),
         declared ? Ink::good_bold : Ink::plain);
    fact("reason", text(channel, "reason"));
}

void put_channel_page(Frame& frame, const WatchScene& scene) {
    const json& channels = list(scene.channels, "channels");
    const std::size_t chosen = scene.chosen.value_or(0);
    if (chosen < channels.size()) {
        put_channel_facts(frame, channels[chosen]);
        constexpr std::size_t around = 4;  // two rules, the axis of n, the keys
        const std::size_t room = frame.rows_left() > around ? frame.rows_left() - around : 0;
        const std::size_t height = std::min<std::size_t>(room / 2, 16);
        if (height > 1) {
            put_recent(frame, channels[chosen], height);
            put_curve(frame, scene.curve, height);
        }
    }
    put_keys(frame, {{"up/down", "other channel"},
                     {"Esc", "all channels"},
                     {"e", "events"},
                     {"?", "help"},
                     {"q", "quit"}});
}

void put_help_page(Frame& frame) {
    put_rule(frame, "keys");
    const auto entry = [&](std::string_view key, std::string_view what, Ink ink = Ink::bold) {
        FrameLine line = frame.line();
        line.add(fmt::format(" {:<15}", key), ink);
        line.add(what);
        frame.put(line);
    };
    entry("up/down, k/j", "choose a channel; in the events: older, newer");
    entry("Enter", "the channel: its course, where it settles and why, RMSE by n");
    entry("e", "all events; space and b turn pages");
    entry("Esc, c", "back to all channels");
    entry("q", "quit; the test goes on");
    frame.put("");
    put_rule(frame, "what is shown");
    entry("12.34", "declared: it settles here, proved, in its 90 % interval", Ink::good_bold);
    entry("12.34", "the newest estimate: not proved yet, it may still move", Ink::dim);
    entry("resid C", "measured less simulated; red: more than noise and model allow", Ink::dim);
    entry("open, gap ...", "no reading: never a number that the sensor did not send", Ink::bad);
    entry("left", "time until 95 % of the rise", Ink::dim);
    entry("n, RMSE", "lags of the regression, and its error over the window", Ink::dim);
    entry("trend", "since the start of the test, each channel on its own scale", Ink::dim);
    put_keys(frame, {{"Esc", "all channels"}, {"q", "quit"}});
}

void put_channels_page(Frame& frame, const WatchScene& scene) {
    const std::size_t channels = list(scene.channels, "channels").size();
    const bool is_roomy = frame.rows_left() > channels + 8;
    if (is_roomy) frame.put("");
    const std::size_t room =
        frame.rows_left() > 2 ? frame.rows_left() - 2 : 0;  // without the titles and the keys
    put_channels(frame, scene, room);
    if (is_roomy) frame.put("");
    if (frame.rows_left() > 2) {
        put_rule(frame, "events");
        put_events(frame, scene, frame.rows_left() - 1);
    }
    put_keys(frame,
             {{"up/down", "choose"}, {"Enter", "channel"}, {"e", "events"}, {"?", "help"}, {"q", "quit"}});
}

}  // namespace

DeclaredCount count_declared(const json& channels) {
    DeclaredCount count;
    for (const json& channel : list(channels, "channels")) {
        // A channel that hardly warms has nothing to declare, and nobody waits for it; the ambient is an
        // input.
        if (!flag(channel, "required") || text(channel, "role") == "ambient") continue;
        if (text(channel, "state") == "barely_warming") continue;
        ++count.required;
        if (text(channel, "state") == "declared") ++count.declared;
    }
    return count;
}

std::string scan_line(const json& channels, const json& status) {
    const auto time_min = number(channels, "time_min");
    std::string line = time_min ? fmt::format("{:.2f} min", *time_min) : std::string("no test");
    for (const json& channel : list(channels, "channels")) {
        line += fmt::format(" {}={}", text(channel, "channel"), value_or_quality(channel, false));
    }
    const DeclaredCount count = count_declared(channels);
    line += fmt::format(" {}", text(status, "state"));
    if (time_min) line += fmt::format(", {} of {} declared", count.declared, count.required);
    return printable(line);
}

std::string render_frame(const WatchScene& scene, FrameSize size, FrameLook look) {
    Frame frame(size, look);
    put_title(frame, scene);
    put_summary(frame, scene);
    switch (scene.page) {
        case WatchScene::Page::channels:
            put_channels_page(frame, scene);
            break;
        case WatchScene::Page::channel:
            put_channel_page(frame, scene);
            break;
        case WatchScene::Page::events:
            put_rule(frame, scene.events_back == 0
                                ? "events"
                                : fmt::format("events, {} newer below", scene.events_back));
            put_events(frame, scene, frame.rows_left() > 1 ? frame.rows_left() - 1 : 0);
            put_keys(frame,
                     {{"up/down", "older, newer"}, {"Esc", "all channels"}, {"?", "help"}, {"q", "quit"}});
            break;
        case WatchScene::Page::help:
            put_help_page(frame);
            break;
    }
    return frame.str();
}

}  // namespace thermbal
