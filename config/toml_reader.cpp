#include "toml_reader.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <sstream>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace thermbal {
namespace {

std::string shown(const toml::node& node) {
    if (const auto text = node.value_exact<std::string>()) return toml_quoted(*text);
    std::ostringstream text;
    node.visit([&](const auto& value) { text << value; });
    std::string one_line = text.str();
    std::ranges::replace(one_line, '\n', ' ');
    constexpr std::size_t enough = 60;
    if (one_line.size() > enough) one_line = one_line.substr(0, enough) + "...";
    return one_line;
}

std::size_t edit_distance(std::string_view a, std::string_view b) {
    std::vector<std::size_t> row(b.size() + 1);
    std::iota(row.begin(), row.end(), std::size_t{0});
    for (std::size_t i = 1; i <= a.size(); ++i) {
        std::size_t diagonal = row[0];
        row[0] = i;
        for (std::size_t j = 1; j <= b.size(); ++j) {
            const std::size_t substituted = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
            diagonal = row[j];
            row[j] = std::min({row[j] + 1, row[j - 1] + 1, substituted});
        }
    }
    return row[b.size()];
}

bool inside(double value, Range accepted) {
    return value >= accepted.low && value <= accepted.high;
}

}  // namespace

void Complaints::add(const toml::source_region& where, std::string_view key, std::string_view what) {
    found_.push_back({where.begin, key.empty() ? std::string(what) : fmt::format("{}: {}", key, what)});
}

Error Complaints::error() const {
    std::vector<Complaint> in_order = found_;
    std::ranges::stable_sort(in_order, [](const Complaint& a, const Complaint& b) {
        return std::pair(a.where.line, a.where.column) < std::pair(b.where.line, b.where.column);
    });
    std::string message;
    for (const Complaint& complaint : in_order) {
        message += fmt::format("{}{}:{}:{}: {}", message.empty() ? "" : "\n", file_name_,
                               complaint.where.line, complaint.where.column, complaint.text);
    }
    return {.next = NextStep::refuse_input, .message = std::move(message)};
}

std::optional<toml::table> parse_toml(std::string_view text, Complaints& complaints) {
    try {
        return toml::parse(text);
    } catch (const toml::parse_error& error) {
        complaints.add(error.source(), "", error.description());
        return std::nullopt;
    }
}

std::string TableReader::name(std::string_view key) const {
    if (path_.empty() || key.empty()) return path_ + std::string(key);
    return fmt::format("{}.{}", path_, key);
}

const toml::node* TableReader::take(std::string_view key) {
    taken_.emplace(key);
    return table_.get(key);
}

void TableReader::complain(std::string_view key, std::string_view what) {
    const toml::node* node = table_.get(key);
    complaints_.add(node == nullptr ? table_.source() : node->source(), name(key), what);
}

void TableReader::require(std::string_view key, std::string_view accepted) {
    taken_.emplace(key);
    if (!has(key)) complain(key, fmt::format("is missing; accepted: {}", accepted));
}

std::optional<std::string> TableReader::text(std::string_view key) {
    const toml::node* node = take(key);
    if (node == nullptr) return std::nullopt;
    if (const auto value = node->value_exact<std::string>()) return value;
    complain(key, fmt::format("found {}; accepted: a text in quotes", shown(*node)));
    return std::nullopt;
}

std::optional<bool> TableReader::boolean(std::string_view key) {
    const toml::node* node = take(key);
    if (node == nullptr) return std::nullopt;
    if (const auto value = node->value_exact<bool>()) return value;
    complain(key, fmt::format("found {}; accepted: true or false", shown(*node)));
    return std::nullopt;
}

std::optional<double> TableReader::number(std::string_view key, Range accepted) {
    const toml::node* node = take(key);
    if (node == nullptr) return std::nullopt;
    const auto value = node->is_number() ? node->value<double>() : std::nullopt;
    // -0.0 would be written out as -0, which TOML reads as the whole number 0.
    if (value && inside(*value, accepted)) return *value + 0.0;
    complain(key, fmt::format("found {}; accepted: a number from {} to {}", shown(*node), accepted.low,
                              accepted.high));
    return std::nullopt;
}

std::optional<int> TableReader::integer(std::string_view key, Range accepted) {
    const toml::node* node = take(key);
    if (node == nullptr) return std::nullopt;
    const auto value = node->value_exact<std::int64_t>();
    if (value && inside(static_cast<double>(*value), accepted)) return static_cast<int>(*value);
    complain(key, fmt::format("found {}; accepted: a whole number from {:.0f} to {:.0f}", shown(*node),
                              accepted.low, accepted.high));
    return std::nullopt;
}

std::optional<double> TableReader::register_number(std::string_view key) {
    const toml::node* node = take(key);
    if (node == nullptr) return std::nullopt;
    if (node->is_number()) {
        const auto value = node->value<double>();
        if (value && std::isfinite(*value)) return value;
    }
    complain(key, fmt::format("found {}; accepted: a number as the register holds it", shown(*node)));
    return std::nullopt;
}

std::optional<std::vector<std::string>> TableReader::texts(std::string_view key) {
    const toml::node* node = take(key);
    if (node == nullptr) return std::nullopt;
    std::vector<std::string> values;
    if (const toml::array* array = node->as_array()) {
        for (const toml::node& entry : *array) {
            if (auto value = entry.value_exact<std::string>()) values.push_back(std::move(*value));
        }
        if (values.size() == array->size()) return values;
    }
    complain(key, fmt::format("found {}; accepted: a list of texts", shown(*node)));
    return std::nullopt;
}

std::optional<std::vector<int>> TableReader::integers(std::string_view key, Range accepted) {
    const toml::node* node = take(key);
    if (node == nullptr) return std::nullopt;
    std::vector<int> values;
    if (const toml::array* array = node->as_array()) {
        for (const toml::node& entry : *array) {
            const auto value = entry.value_exact<std::int64_t>();
            if (value && inside(static_cast<double>(*value), accepted))
                values.push_back(static_cast<int>(*value));
        }
        if (values.size() == array->size()) return values;
    }
    complain(key, fmt::format("found {}; accepted: a list of whole numbers from {:.0f} to {:.0f}",
                              shown(*node), accepted.low, accepted.high));
    return std::nullopt;
}

std::optional<std::size_t> TableReader::choice(std::string_view key,
                                               std::initializer_list<std::string_view> choices) {
    const toml::node* node = take(key);
    if (node == nullptr) return std::nullopt;
    if (const auto value = node->value_exact<std::string>()) {
        const auto* found = std::ranges::find(choices, *value);
        if (found != choices.end()) return static_cast<std::size_t>(found - choices.begin());
    }
    complain(key, fmt::format("found {}; accepted: \"{}\"", shown(*node), fmt::join(choices, "\", \"")));
    return std::nullopt;
}

const toml::table* TableReader::table(std::string_view key) {
    const toml::node* node = take(key);
    if (node == nullptr) return nullptr;
    if (const toml::table* found = node->as_table()) return found;
    complain(key, fmt::format("found {}; accepted: a table", shown(*node)));
    return nullptr;
}

std::vector<const toml::table*> TableReader::tables(std::string_view key) {
    const toml::node* node = take(key);
    if (node == nullptr) return {};
    std::vector<const toml::table*> found;
    if (const toml::array* array = node->as_array()) {
        for (const toml::node& entry : *array) {
            if (const toml::table* one = entry.as_table()) found.push_back(one);
        }
        if (found.size() == array->size()) return found;
    }
    complain(key,
             fmt::format("found {}; accepted: tables, each beginning with [[{}]]", shown(*node), name(key)));
    return {};
}

void TableReader::finish() {
    for (auto&& [key, node] : table_) {
        if (taken_.contains(key.str())) continue;
        const std::string meant = nearest(key.str(), taken_);
        complaints_.add(key.source(), name(key.str()),
                        meant.empty()
                            ? fmt::format("is not known here; accepted: {}", fmt::join(taken_, ", "))
                            : fmt::format("is not known here; did you mean {}?", meant));
    }
}

std::string_view transport_name(Transport transport) {
    switch (transport) {
        case Transport::tcp:
            return "tcp";
        case Transport::rtu:
            return "rtu";
        case Transport::rtu_over_tcp:
            return "rtu_over_tcp";
    }
    return "";
}

std::string_view parity_name(char parity) {
    return parity == 'N' ? "none" : parity == 'E' ? "even" : "odd";
}

std::string toml_quoted(std::string_view text) {
    std::string result = "\"";
    for (const char c : text) {
        if (c == '"' || c == '\\')
            result += {'\\', c};
        else if (static_cast<unsigned char>(c) < 0x20 || c == 0x7F)
            result += fmt::format("\\u{:04X}", c);
        else
            result += c;
    }
    return result + '"';
}

std::string nearest(std::string_view word, const std::set<std::string, std::less<>>& candidates) {
    std::string best;
    std::size_t best_distance = std::max<std::size_t>(2, word.size() / 3) + 1;
    for (const std::string& candidate : candidates) {
        const std::size_t distance = edit_distance(word, candidate);
        if (distance < best_distance) {
            best_distance = distance;
            best = candidate;
        }
    }
    return best;
}

}  // namespace thermbal
