#pragma once

#include <string>
#include <vector>

#include "modbus/profile.hpp"

namespace thermbal {

/// Every module profile in the folders of profile_folders(own), in their order, by name. A file that cannot
/// be read is left out: it is no reason not to look at a module.
std::vector<ModuleProfile> profiles_there(const std::vector<std::string>& own);

}  // namespace thermbal
