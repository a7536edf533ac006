#pragma once

#include <CLI/CLI.hpp>

namespace thermbal {

/// For flags that are numbers with a point: one from `low` to `high`, both included. Unlike CLI::Range it
/// does not take "nan", which is neither below nor above anything.
CLI::Validator number_in(double low, double high);

}  // namespace thermbal
