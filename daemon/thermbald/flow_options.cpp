#include "flow_options.hpp"

namespace thermbal {

FlowOptions flow_options(const Config& config) {
    FlowOptions options;
    const auto ambient = config.ambient();
    options.ambient = ambient ? config.channels[*ambient].name : "";
    options.tolerance_C = config.identification.tolerance_C;
    options.sweep.last_lag = static_cast<std::size_t>(config.identification.max_lag);
    options.sweep_when = config.identification.sweep_always ? SweepWhen::always : SweepWhen::needed;
    return options;
}

}  // namespace thermbal
