#include "compute/declaration_record.hpp"

#include <utility>

namespace thermbal {

DeclarationRecord declaration_record(const ChannelVerdict& verdict, std::int64_t window_end_scan,
                                     std::string basis_json, std::string version) {
    return {.channel = verdict.channel,
            .window_end_scan = window_end_scan,
            .declared_at_min = verdict.declared_at_min,
            .n = verdict.n,
            .C = verdict.svr.C,
            .sigma = verdict.svr.sigma,
            .steady_state_C = verdict.steady_state_C,
            .steady_state_low_C = verdict.steady_state_low_C,
            .steady_state_high_C = verdict.steady_state_high_C,
            .equilibrium_time_min = verdict.equilibrium_time_min,
            .rmse_by_n_C = verdict.rmse_by_n_C,
            .basis_json = std::move(basis_json),
            .version = std::move(version),
            .withdrawn = {}};
}

}  // namespace thermbal
