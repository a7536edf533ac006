#pragma once

#include <vector>

#include "config/config.hpp"
#include "toml_reader.hpp"

namespace thermbal {

/// The tables that a configuration was read from, beside its vectors: where a complaint points to.
struct ConfigTables {
    const toml::table* root = nullptr;
    std::vector<const toml::table*> lines;
    std::vector<const toml::table*> units;
    std::vector<const toml::table*> channels;
    std::vector<const toml::table*> alarms;
};

/// What no single key can tell: names and addresses given twice, roles, and whether the calls of a line fit
/// into the period even when every one of them fails as slowly as it can.
void check_config(const Config& config, const ConfigTables& tables, Complaints& complaints);

}  // namespace thermbal
