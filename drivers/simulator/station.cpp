#include "simulator/station.hpp"

#include <utility>

namespace thermbal {
namespace {

constexpr std::size_t channels = 16;

}  // namespace

Station::Station(ModbusModule module, ScanSource source, std::vector<Fault> faults, SimClock clock,
                 ForeignUnit foreign_unit, StationListeners listeners)
    : module_(std::move(module)),
      source_(std::move(source)),
      faults_(std::move(faults)),
      clock_(clock),
      foreign_unit_(foreign_unit),
      listeners_(std::move(listeners)) {}

std::vector<Delivery> Station::serve(Framing framing, const ModbusRequest& request, std::int64_t now_ns) {
    if (!module_.has_unit(request.unit)) return serve_foreign(framing, request);
    const double time_s = clock_.time_of_request_s(now_ns, module_.begins_scan(request));
    const ModuleReply reply = module_.answer(request, [this, time_s] { return inputs_at(time_s); });
    const std::optional<Fault> fault = line_fault(faults_, request.unit, time_s);
    report(request, reply, fault, time_s);
    return deliveries(framing, request, reply.pdu, fault);
}

std::vector<Delivery> Station::serve_foreign(Framing framing, const ModbusRequest& request) {
    if (framing == Framing::rtu || foreign_unit_ == ForeignUnit::silence) return {};
    return deliveries(framing, request,
                      exception_pdu(request.pdu.front(), ModbusException::gateway_target_silent), {});
}

void Station::report(const ModbusRequest& request, const ModuleReply& reply,
                     const std::optional<Fault>& fault, double time_s) {
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
                        .fault = fault ? std::string(to_string(fault->kind)) : std::string(),
                        .words = reply.words});
}

ModuleInputs Station::inputs_at(double time_s) {
    ModuleInputs inputs{.value_C = source_.read_C(time_s), .state = {}};
    inputs.value_C.resize(channels, std::numeric_limits<double>::quiet_NaN());
    for (std::size_t channel = 0; channel < channels; ++channel) {
        inputs.state.push_back(sensor_state(faults_, channel, time_s));
    }
    return inputs;
}

}  // namespace thermbal
