#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

namespace thermbal {

/// A line of a plot; NaN breaks it. `colour`: any CSS colour.
struct PlotLine {
    std::string name;
    std::string colour;
    Eigen::VectorXd values;
};

/// A line plot over minutes as an <svg> element, at most about 600 points a line.
std::string svg_plot(const std::vector<double>& time_s, const std::vector<PlotLine>& lines,
                     const std::string& unit, int height_px);

}  // namespace thermbal
