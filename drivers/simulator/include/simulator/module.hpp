#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "simulator/frames.hpp"
#include "simulator/register_map.hpp"

namespace thermbal {

enum class ModbusException : std::uint8_t {
    illegal_function = 1,
    illegal_address = 2,
    illegal_value = 3,
    gateway_target_silent = 11,
};

Bytes exception_pdu(std::uint8_t function, ModbusException exception);

/// One unit id and the channels (from 0) behind it.
struct ModuleUnit {
    std::uint8_t id = 1;
    std::size_t first_channel = 0;
    std::size_t channels = 16;
};

/// What the sensors of all channels give at the moment of a read.
struct ModuleInputs {
    std::vector<double> value_C;
    std::vector<SensorState> state = {};
};

struct ModuleWrite {
    bool coils = false;  ///< coils, or holding registers
    std::uint16_t address = 0;
    std::vector<std::uint16_t> values = {};
};

struct ModuleReply {
    Bytes pdu;
    std::vector<std::uint16_t>
        words;  ///< the registers that it carries; empty for exceptions, coils and writes
    std::optional<ModuleWrite> write = {};
};

/// The module's registers behind function codes 1 (read coils), 3, 4 (read registers), 5, 6, 15, 16 (write).
/// Every unit has 16 coils from 0 and 16 free holding registers from 1000; coil 0 says that the spindle runs
/// and starts set.
class ModbusModule {
  public:
    static constexpr std::size_t coils = 16;
    static constexpr std::uint16_t first_output_register = 1000;
    static constexpr std::size_t output_registers = 16;

    ModbusModule(RegisterMap map, std::vector<ModuleUnit> units);

    bool has_unit(std::uint8_t id) const { return find(id) != nullptr; }
    /// Whether a request reads the first temperature register of the first unit: once a scan, by who polls in
    /// order.
    bool begins_scan(const ModbusRequest& request) const;
    /// REQUIRES: has_unit(request.unit). `inputs` is called at most once, and only by a read of registers.
    ModuleReply answer(const ModbusRequest& request, const std::function<ModuleInputs()>& inputs);

    const std::vector<ModuleUnit>& units() const { return units_; }

  private:
    struct Outputs {
        std::array<bool, coils> coil{};
        std::array<std::uint16_t, output_registers> register_value{};
    };

    const ModuleUnit* find(std::uint8_t id) const;
    Outputs& outputs(std::uint8_t id);
    std::optional<std::uint16_t> word(const ModuleUnit& unit, bool holding, std::uint16_t address,
                                      const ModuleInputs& inputs);
    bool readable(const ModuleUnit& unit, bool holding, std::uint16_t address) const;

    ModuleReply read_coils(const ModbusRequest& request);
    ModuleReply read_registers(const ModbusRequest& request, const std::function<ModuleInputs()>& inputs);
    ModuleReply write_one(const ModbusRequest& request);
    ModuleReply write_many(const ModbusRequest& request);
    bool store(std::uint8_t unit, const ModuleWrite& write);

    RegisterMap map_;
    std::vector<ModuleUnit> units_;
    std::vector<Outputs> outputs_;  ///< one a unit
};

}  // namespace thermbal
