#pragma once

#include <cstdint>
#include <string>

#include "declaration/verdict.hpp"
#include "store/records.hpp"

namespace thermbal {

/// A declared channel's row. `basis_json`: the whole verdict. `version`: of the program that declares.
DeclarationRecord declaration_record(const ChannelVerdict& verdict, std::int64_t window_end_scan,
                                     std::string basis_json, std::string version);

}  // namespace thermbal
