#include "simulator/station.hpp"

#include <utility>

namespace thermbal {
namespace {

constexpr std::size_t channels = 16;

}  // namespace

Station::Station(ModbusModule module, ScanSource source, FaultPlan plan, SimClock clock,
                 ForeignUnit foreign_unit, StationListeners listeners, std::uint64_t noise_seed)
    : module_(std::move(module)),
      source_(std::move(source)),
      plan_(std::move(plan)),
      clock_(clock),
      foreign_unit_(foreign_unit),
      listeners_(std::move(listeners)),
      random_(noise_seed) {}

std::vector<Delivery> Station::serve(Framing framing, const ModbusRequest& request, std::int64_t now_ns) {
    if (!module_.has_unit(request.unit)) return serve_foreign(framing, request);
    const double time_s = clock_.time_of_request_s(now_ns, module_.begins_scan(request));
    const ModuleReply reply = module_.answer(request, [&, this] { return measured(request.unit, time_s); });
    const std::optional<Fault> fault = plan_.on_reply(request.unit, time_s);
    std::string what(fault ? entry_of(fault->kind).name : "");
    if (what.empty() && plan_.frozen(request.unit, time_s)) what = "frozen";
    report(request, reply, what, time_s);
    return deliveries(framing, request, reply.pdu, fault, random_);
}

std::vector<Delivery> Station::serve_foreign(Framing framing, const ModbusRequest& request) {
    if (framing == Framing::rtu || foreign_unit_ == ForeignUnit::silence) return {};
    return deliveries(framing, request,
                      exception_pdu(request.pdu.front(), ModbusException::gateway_target_silent), {},
                      random_);
}

void Station::report(const ModbusRequest& request, const ModuleReply& reply, const std::string& fault,
                     double time_s) {
    if (reply.write) {
        listeners_.on_write(time_s, request.unit, *reply.write);
        const bool first_unit = request.unit == module_.units().front().id;
        if (first_unit && reply.write->coils && reply.write->address == 0) {
            source_.run_spindle(time_s, reply.write->values.front() != 0);
        }
    }
    if (reply.words.empty()) return;
    listeners_.on_read({.time_s = time_s,
                        .unit = request.unit,
                        .function = request.pdu[0],
                        .address = static_cast<std::uint16_t>((request.pdu[1] << 8U) | request.pdu[2]),
                        .fault = fault,
                        .words = reply.words});
}

ModuleInputs Station::inputs_at(double time_s) {
    ModuleInputs inputs{.value_C = source_.read_C(time_s), .state = {}};
    inputs.value_C.resize(channels, std::numeric_limits<double>::quiet_NaN());
    for (std::size_t channel = 0; channel < channels; ++channel) {
        inputs.state.push_back(plan_.sensor_state(channel, time_s));
    }
    return inputs;
}

const ModuleInputs& Station::measured(std::uint8_t unit, double time_s) {
    const auto last = measured_.find(unit);
    if (last != measured_.end() && plan_.frozen(unit, time_s)) return last->second;
    return measured_[unit] = inputs_at(time_s);
}

}  // namespace thermbal
