#pragma once

#include <string_view>

#include "sqlite.hpp"
#include "store/records.hpp"

namespace thermbal {

// How a row of a query becomes a record; each belongs to the columns that stand beside it, in their order.

inline constexpr std::string_view event_columns = "id, test_id, wall_ns, time_s, kind, channel, message";
EventRecord event_in(const sqlite::Statement& row);

/// With `channels c` and `declarations d`; what follows begins at column declaration_column_count.
inline constexpr std::string_view declaration_columns =
    "c.name, d.window_end_scan, d.declared_at_min, d.n, d.C, d.sigma, d.steady_state_C, "
    "d.steady_state_low_C, d.steady_state_high_C, d.equilibrium_time_min, d.rmse_by_n_C, d.basis, "
    "d.version, d.withdrawn";
inline constexpr int declaration_column_count = 14;
DeclarationRecord declaration_in(const sqlite::Statement& row);

}  // namespace thermbal
