#pragma once

#include <string>

#include "options.hpp"
#include "simulator/truth.hpp"

namespace thermbal {

/// What --truth prints: a table for people, or JSON with the same names as `thermbalctl identify`.
std::string truth_table(const SimulatorOptions& options, const Truth& truth);
std::string truth_json(const SimulatorOptions& options, const Truth& truth);

/// Every number of the plant, so that another integrator can check it.
std::string plant_json(const SimulatorOptions& options, const PlantDescription& plant);

/// The lines that say where a written recording comes from.
std::string recording_comments(const SimulatorOptions& options);

}  // namespace thermbal
