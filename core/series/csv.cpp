#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <set>

#include <fmt/format.h>

#include "series/recorded_test.hpp"
#include "series/sample.hpp"
#include "series/temperature.hpp"

namespace thermbal {
namespace {

struct Cell {
    std::string text;
    std::size_t line = 0;
    std::size_t column = 0;
};

/// Splits RFC 4180 text into records, one call each. Quoted cells may hold commas, quotes and line ends.
class CsvReader {
  public:
    explicit CsvReader(std::string_view text) : text_(text) {
        if (text_.starts_with("\xEF\xBB\xBF")) text_.remove_prefix(3);
    }

    bool at_end() const { return at_ >= text_.size(); }
    bool at_comment() const { return !at_end() && text_[at_] == '#'; }

    void skip_line() {
        while (!at_end() && text_[at_] != '\n') ++at_;
        take_line_end();
    }

    /// The cells of the next record; empty cells for an empty line; nullopt for an unclosed quote, or text
    /// behind a closed one.
    std::optional<std::vector<Cell>> next() {
        std::vector<Cell> cells;
        for (;;) {
            Cell cell{{}, line_, at_ - line_start_ + 1};
            if (!take_cell(cell.text)) return std::nullopt;
            cells.push_back(std::move(cell));
            if (!at_end() && text_[at_] == ',') {
                ++at_;
                continue;
            }
            take_line_end();
            return cells;
        }
    }

    std::size_t line() const { return line_; }

  private:
    bool take_cell(std::string& into) {
        if (at_end() || text_[at_] != '"') {
            while (!at_end() && text_[at_] != ',' && text_[at_] != '\n' && text_[at_] != '\r')
                into += text_[at_++];
            return true;
        }
        for (++at_; !at_end(); ++at_) {
            if (text_[at_] == '"') {
                if (at_ + 1 >= text_.size() || text_[at_ + 1] != '"') {
                    ++at_;
                    return at_end() || text_[at_] == ',' || text_[at_] == '\r' || text_[at_] == '\n';
                }
                ++at_;
            }
            if (text_[at_] == '\n') ++line_;
            into += text_[at_];
        }
        return false;
    }

    void take_line_end() {
        if (!at_end() && text_[at_] == '\r') ++at_;
        if (!at_end() && text_[at_] == '\n') ++at_;
        ++line_;
        line_start_ = at_;
    }

    std::string_view text_;
    std::size_t at_ = 0;
    std::size_t line_ = 1;
    std::size_t line_start_ = 0;
};

bool is_channel_name(std::string_view name) {
    return name.size() >= 2 && name.size() <= 6 && name[0] == 'T' &&
           std::ranges::all_of(name.substr(1), [](char c) { return c >= '0' && c <= '9'; });
}

/// A finite number, or NaN for an empty cell; nullopt for anything else.
std::optional<double> parse_cell(std::string_view text) {
    while (!text.empty() && (text.front() == ' ' || text.front() == '\t')) text.remove_prefix(1);
    while (!text.empty() && (text.back() == ' ' || text.back() == '\t')) text.remove_suffix(1);
    if (text.empty()) return no_value;
    double value = 0.0;
    const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (code != std::errc{} || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
    return value;
}

/// On the grid of its scans a recording with gaps is longer than its rows. So many scans are always taken (a
/// week at 1 s is 604 800, a month at 15 s 178 560), and of more rows twice as many.
constexpr std::size_t always_taken_scans = 1'000'000;
constexpr std::size_t most_scans_per_row = 2;

constexpr std::string_view bad_quotes = "a quoted cell is not closed, or text follows its closing quote";

/// As a cell of RFC 4180.
std::string quoted_where_needed(const std::string& text) {
    if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
    std::string cell = "\"";
    for (const char c : text) cell += c == '"' ? std::string("\"\"") : std::string(1, c);
    return cell + '"';
}

std::unexpected<Error> refuse(std::string_view name, std::size_t line, std::size_t column,
                              std::string_view what) {
    return fail(NextStep::refuse_input, fmt::format("{}:{}:{}: {}", name, line, column, what));
}

/// A time that lies far off would make a grid that no memory holds. `lines`: of each row.
Result<void> check_span(const RecordedTest& test, const std::vector<std::size_t>& lines,
                        std::string_view name) {
    if (test.time_s.size() < 2) return {};
    const double period_s = median_step_s(test);
    const double scans = (test.time_s.back() - test.time_s.front()) / period_s;
    const auto most =
        static_cast<double>(std::max(always_taken_scans, most_scans_per_row * test.time_s.size()));
    if (scans <= most) return {};
    std::size_t far = 1;
    for (std::size_t row = 2; row < test.time_s.size(); ++row) {
        if (test.time_s[row] - test.time_s[row - 1] > test.time_s[far] - test.time_s[far - 1]) far = row;
    }
    return refuse(
        name, lines[far], 1,
        fmt::format("time_s is {} after {}; with a row each {:.6g} s (median) the recording would be "
                    "{:.4g} scans long, {:.0f} are taken. Mend the time, or split the file here",
                    test.time_s[far], test.time_s[far - 1], period_s, scans, most));
}

}  // namespace

bool is_input_name(std::string_view name) {
    const auto is_letter = [](char c) {
        return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
    };
    const auto fits = [&](char c) { return is_letter(c) || (c >= '0' && c <= '9'); };
    return !name.empty() && name.size() <= 64 && is_letter(name.front()) && std::ranges::all_of(name, fits) &&
           !is_channel_name(name) && name != "time_s";
}

Result<RecordedTest> parse_recorded_test(std::string_view csv_text, std::string_view name) {
    CsvReader reader(csv_text);
    while (reader.at_comment()) reader.skip_line();
    if (reader.at_end()) return refuse(name, reader.line(), 1, "no header found; expected time_s,T1,...");
    const auto header = reader.next();
    if (!header) return refuse(name, reader.line(), 1, bad_quotes);
    if (header->front().text != "time_s") {
        return refuse(name, header->front().line, 1,
                      fmt::format("first column is '{}', expected time_s", header->front().text));
    }

    RecordedTest test;
    std::set<std::string> seen;
    std::vector<std::pair<bool, std::size_t>>
        target;  // (is a channel, index among its kind) of columns 1, 2, ...
    for (std::size_t i = 1; i < header->size(); ++i) {
        const Cell& cell = (*header)[i];
        if (cell.text.empty()) return refuse(name, cell.line, cell.column, "a column has no name");
        if (!seen.insert(cell.text).second) {
            return refuse(name, cell.line, cell.column, fmt::format("column '{}' stands twice", cell.text));
        }
        auto& columns = is_channel_name(cell.text) ? test.channels : test.inputs;
        target.emplace_back(&columns == &test.channels, columns.size());
        columns.push_back({cell.text, {}});
    }

    std::vector<std::size_t> lines;
    while (!reader.at_end()) {
        const auto record = reader.next();
        if (!record) return refuse(name, reader.line(), 1, bad_quotes);
        const Cell& first = record->front();
        if (record->size() == 1 && first.text.empty()) continue;  // an empty line
        if (record->size() != header->size()) {
            return refuse(name, first.line, 1,
                          fmt::format("{} cells, the header has {}", record->size(), header->size()));
        }
        const auto time_s = parse_cell(first.text);
        if (!time_s || std::isnan(*time_s)) {
            return refuse(name, first.line, 1, fmt::format("time_s is '{}', expected a number", first.text));
        }
        if (!test.time_s.empty() && *time_s <= test.time_s.back()) {
            return refuse(name, first.line, 1,
                          fmt::format("time_s is {} after {}, expected strictly increasing times", *time_s,
                                      test.time_s.back()));
        }
        test.time_s.push_back(*time_s);
        lines.push_back(first.line);
        for (std::size_t i = 1; i < record->size(); ++i) {
            const Cell& cell = (*record)[i];
            const auto value = parse_cell(cell.text);
            if (!value) {
                return refuse(name, cell.line, cell.column,
                              fmt::format("{} is '{}', expected a number or an empty cell", (*header)[i].text,
                                          cell.text));
            }
            const auto [is_channel, index] = target[i - 1];
            if (is_channel && !std::isnan(*value) && !is_temperature(*value)) {
                return refuse(
                    name, cell.line, cell.column,
                    fmt::format("{} is {} C, which is no temperature ({} to {} C); leave the cell empty "
                                "where there is no reading",
                                (*header)[i].text, cell.text, absolute_zero_C, hottest_reading_C));
            }
            (is_channel ? test.channels : test.inputs)[index].values.push_back(*value);
        }
    }
    if (test.time_s.empty()) return refuse(name, reader.line(), 1, "the header is there, no row follows it");
    if (auto sound = check_span(test, lines, name); !sound) return std::unexpected(sound.error());
    return test;
}

std::string format_recorded_test(const RecordedTest& test) {
    std::string text = "time_s";
    for (const Column& column : test.channels) text += "," + quoted_where_needed(column.name);
    for (const Column& column : test.inputs) text += "," + quoted_where_needed(column.name);
    text += "\r\n";
    const auto add = [&](const Column& column, std::size_t row) {
        text += ',';
        if (std::isfinite(column.values[row])) text += fmt::format("{}", column.values[row]);
    };
    for (std::size_t row = 0; row < test.time_s.size(); ++row) {
        text += fmt::format("{}", test.time_s[row]);
        for (const Column& column : test.channels) add(column, row);
        for (const Column& column : test.inputs) add(column, row);
        text += "\r\n";
    }
    return text;
}

}  // namespace thermbal
