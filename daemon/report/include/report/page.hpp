#pragma once

#include <map>
#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

#include "report/plot.hpp"

namespace thermbal {

/// One HTML file that needs nothing else: style, scripts and data are inside, nothing is fetched. Tables are
/// given first, then plots of them, each placed where its figure is put into the page's text.
class Page {
  public:
    explicit Page(std::string title) : title_(std::move(title)) {}

    void add_table(PlotTable table);
    /// The figure of a plot, for add(). REQUIRES: its table has been added.
    std::string figure(const Plot& plot);
    /// HTML; text from outside in it is escaped() by the caller.
    void add(std::string_view html) { body_ += html; }

    std::string html() const;

  private:
    std::string title_;
    std::string body_;
    std::map<std::string, PlotTable, std::less<>> tables_;
    nlohmann::json plots_ = nlohmann::json::object();
};

/// {"x_label", "x": [...], "columns": {name: [...]}}, null for NaN: what the page's plots are drawn from.
nlohmann::json table_to_json(const PlotTable& table);

}  // namespace thermbal
