#pragma once

#include <concepts>
#include <initializer_list>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include <toml++/toml.h>

#include "base/error.hpp"
#include "config/quoted.hpp"

namespace thermbal {

/// The mistakes found in one file, told in the order of the file.
class Complaints {
  public:
    explicit Complaints(std::string_view file_name) : file_name_(file_name) {}

    void add(const toml::source_region& where, std::string_view key, std::string_view what);
    bool empty() const { return found_.empty(); }
    /// One line a mistake: FILE:LINE:COLUMN: key: what.
    Error error() const;

  private:
    struct Complaint {
        toml::source_position where;
        std::string text;
    };
    std::string file_name_;
    std::vector<Complaint> found_;
};

/// Parses TOML; a syntax error goes to `complaints` with its position.
std::optional<toml::table> parse_toml(std::string_view text, Complaints& complaints);

struct Range {
    double low;
    double high;
};
inline constexpr Range any_number{-1e12, 1e12};

/// Takes the keys of one table, each with its type and range. What nobody took is an unknown key: finish()
/// says so and proposes the nearest one. A key that is missing or refused gives nothing; the caller keeps its
/// default.
class TableReader {
  public:
    TableReader(const toml::table& table, std::string path, Complaints& complaints)
        : table_(table), path_(std::move(path)), complaints_(complaints) {}

    std::optional<std::string> text(std::string_view key);
    std::optional<bool> boolean(std::string_view key);
    std::optional<double> number(std::string_view key, Range accepted);
    std::optional<int> integer(std::string_view key, Range accepted);
    /// An integer of any size, for register contents.
    std::optional<double> register_number(std::string_view key);
    std::optional<std::vector<std::string>> texts(std::string_view key);
    std::optional<std::vector<int>> integers(std::string_view key, Range accepted);
    /// The position of the text in `choices`.
    std::optional<std::size_t> choice(std::string_view key, std::initializer_list<std::string_view> choices);

    /// A table, or null when there is none.
    const toml::table* table(std::string_view key);
    std::vector<const toml::table*> tables(std::string_view key);

    /// A key that is not judged: no complaint that it is unknown.
    void leave(std::string_view key) { taken_.emplace(key); }

    bool has(std::string_view key) const { return table_.contains(key); }
    void require(std::string_view key, std::string_view accepted);
    void complain(std::string_view key, std::string_view what);
    void finish();

  private:
    const toml::node* take(std::string_view key);
    std::string name(std::string_view key) const;

    const toml::table& table_;
    std::string path_;
    Complaints& complaints_;
    std::set<std::string, std::less<>> taken_;
};

template <typename T>
void set(T& field, const std::optional<T>& value) {
    if (value) field = *value;
}

/// The one of `candidates` that `word` was probably meant to be; empty when none is near.
std::string nearest(std::string_view word, const std::set<std::string, std::less<>>& candidates);

}  // namespace thermbal
