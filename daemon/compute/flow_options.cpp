#include "compute/flow_options.hpp"

#include <cstddef>

namespace thermbal {

FlowOptions flow_options(const IdentificationConfig& identification) {
    FlowOptions options;
    options.tolerance_C = identification.tolerance_C;
    options.sweep.last_lag = static_cast<std::size_t>(identification.max_lag);
    options.sweep_when = identification.sweep_always ? SweepWhen::always : SweepWhen::needed;
    return options;
}

}  // namespace thermbal
