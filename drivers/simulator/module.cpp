#include "simulator/module.hpp"

#include <algorithm>
#include <utility>

namespace thermbal {
namespace {

constexpr std::uint8_t fc_read_coils = 1;
constexpr std::uint8_t fc_read_holding = 3;
constexpr std::uint8_t fc_read_input = 4;
constexpr std::uint8_t fc_write_coil = 5;
constexpr std::uint8_t fc_write_register = 6;
constexpr std::uint8_t fc_write_coils = 15;
constexpr std::uint8_t fc_write_registers = 16;
constexpr std::uint16_t most_registers_a_read = 125;
constexpr std::uint16_t most_registers_a_write = 123;
constexpr std::uint16_t most_coils_a_read = 2000;
constexpr std::uint16_t most_coils_a_write = 1968;

std::uint16_t word_at(const Bytes& pdu, std::size_t at) {
    return static_cast<std::uint16_t>((pdu[at] << 8U) | pdu[at + 1]);
}

void append_word(Bytes& pdu, std::uint16_t word) {
    pdu.push_back(static_cast<std::uint8_t>(word >> 8U));
    pdu.push_back(static_cast<std::uint8_t>(word & 0xFFU));
}

ModuleReply refused(const ModbusRequest& request, ModbusException exception) {
    return {.pdu = exception_pdu(request.pdu.front(), exception), .words = {}, .write = {}};
}

/// Start and quantity of a request that has both, nothing when it is too short or asks for too many.
struct Block {
    std::uint16_t start = 0;
    std::uint16_t quantity = 0;

    bool ends_within(std::uint32_t addresses) const { return std::uint32_t{start} + quantity <= addresses; }
};

std::optional<Block> block_of(const Bytes& pdu, std::uint16_t most) {
    if (pdu.size() < 5) return std::nullopt;
    const Block block{.start = word_at(pdu, 1), .quantity = word_at(pdu, 3)};
    if (block.quantity == 0 || block.quantity > most) return std::nullopt;
    return block;
}

/// A write of several, when its byte count fits its quantity and its length.
std::optional<ModuleWrite> write_of(const Bytes& pdu) {
    const bool coils = pdu.front() == fc_write_coils;
    const auto block = block_of(pdu, coils ? most_coils_a_write : most_registers_a_write);
    if (!block || pdu.size() < 6) return std::nullopt;
    const std::size_t bytes = coils ? (block->quantity + 7U) / 8U : block->quantity * 2U;
    if (pdu[5] != bytes || pdu.size() != 6 + bytes) return std::nullopt;
    ModuleWrite write{.coils = coils, .address = block->start, .values = {}};
    for (std::size_t i = 0; i < block->quantity; ++i) {
        write.values.push_back(coils ? static_cast<std::uint16_t>((pdu[6 + i / 8] >> (i % 8)) & 1U)
                                     : word_at(pdu, 6 + 2 * i));
    }
    return write;
}

}  // namespace

Bytes exception_pdu(std::uint8_t function, ModbusException exception) {
    return {static_cast<std::uint8_t>(function | 0x80U), static_cast<std::uint8_t>(exception)};
}

ModbusModule::ModbusModule(RegisterMap map, std::vector<ModuleUnit> units)
    : map_(std::move(map)), units_(std::move(units)), outputs_(units_.size()) {
    for (Outputs& unit_outputs : outputs_) unit_outputs.coil[0] = true;
}

const ModuleUnit* ModbusModule::find(std::uint8_t id) const {
    const auto found = std::ranges::find(units_, id, &ModuleUnit::id);
    return found == units_.end() ? nullptr : &*found;
}

ModbusModule::Outputs& ModbusModule::outputs(std::uint8_t id) {
    return outputs_[static_cast<std::size_t>(find(id) - units_.data())];
}

bool ModbusModule::begins_scan(const ModbusRequest& request) const {
    const std::uint8_t function = request.pdu.front();
    const bool reads =
        (function == fc_read_holding && map_.holding) || (function == fc_read_input && map_.input);
    if (!reads || units_.empty() || request.unit != units_.front().id) return false;
    const auto block = block_of(request.pdu, most_registers_a_read);
    return block && block->start <= map_.first && map_.first - block->start < block->quantity;
}

ModuleReply ModbusModule::answer(const ModbusRequest& request, const std::function<ModuleInputs()>& inputs) {
    switch (request.pdu.front()) {
        case fc_read_coils:
            return read_coils(request);
        case fc_read_holding:
        case fc_read_input:
            return read_registers(request, inputs);
        case fc_write_coil:
        case fc_write_register:
            return write_one(request);
        case fc_write_coils:
        case fc_write_registers:
            return write_many(request);
        default:
            return refused(request, ModbusException::illegal_function);
    }
}

bool ModbusModule::readable(const ModuleUnit& unit, bool holding, std::uint16_t address) const {
    if ((holding ? map_.holding : map_.input) && map_.place(address, unit.channels)) return true;
    if (!holding) return false;
    if (address >= first_output_register && address < first_output_register + output_registers) return true;
    return std::ranges::any_of(map_.constants, [address](const auto& c) { return c.first == address; });
}

std::optional<std::uint16_t> ModbusModule::word(const ModuleUnit& unit, bool holding, std::uint16_t address,
                                                const ModuleInputs& inputs) {
    if (holding ? map_.holding : map_.input) {
        if (const auto place = map_.place(address, unit.channels)) {
            const std::size_t channel = unit.first_channel + place->channel;
            return encode_channel(map_, inputs.value_C[channel], inputs.state[channel])[place->word];
        }
    }
    if (!holding) return std::nullopt;
    if (address >= first_output_register && address < first_output_register + output_registers) {
        return outputs(unit.id).register_value[address - first_output_register];
    }
    const auto constant =
        std::ranges::find(map_.constants, address, &std::pair<std::uint16_t, std::uint16_t>::first);
    if (constant == map_.constants.end()) return std::nullopt;
    return constant->second;
}

ModuleReply ModbusModule::read_registers(const ModbusRequest& request,
                                         const std::function<ModuleInputs()>& inputs) {
    const bool holding = request.pdu.front() == fc_read_holding;
    if (!holding && !map_.input) return refused(request, ModbusException::illegal_function);
    const auto block = block_of(request.pdu, most_registers_a_read);
    if (!block || request.pdu.size() != 5) return refused(request, ModbusException::illegal_value);
    if (!block->ends_within(65536)) return refused(request, ModbusException::illegal_address);

    const ModuleUnit& unit = *find(request.unit);
    for (std::uint16_t i = 0; i < block->quantity; ++i) {
        const auto address = static_cast<std::uint16_t>(block->start + i);
        if (!readable(unit, holding, address)) return refused(request, ModbusException::illegal_address);
    }
    const ModuleInputs now = inputs();
    ModuleReply reply;
    reply.pdu = {request.pdu.front(), static_cast<std::uint8_t>(block->quantity * 2)};
    for (std::uint16_t i = 0; i < block->quantity; ++i) {
        const auto value = word(unit, holding, static_cast<std::uint16_t>(block->start + i), now);
        reply.words.push_back(value.value_or(0));
        append_word(reply.pdu, reply.words.back());
    }
    return reply;
}

ModuleReply ModbusModule::read_coils(const ModbusRequest& request) {
    const auto block = block_of(request.pdu, most_coils_a_read);
    if (!block || request.pdu.size() != 5) return refused(request, ModbusException::illegal_value);
    if (!block->ends_within(coils)) return refused(request, ModbusException::illegal_address);
    ModuleReply reply;
    const std::size_t bytes = (block->quantity + 7U) / 8U;
    reply.pdu = {request.pdu.front(), static_cast<std::uint8_t>(bytes)};
    reply.pdu.resize(2 + bytes, 0);
    for (std::size_t i = 0; i < block->quantity; ++i) {
        if (!outputs(request.unit).coil[block->start + i]) continue;
        reply.pdu[2 + i / 8] = static_cast<std::uint8_t>(reply.pdu[2 + i / 8] | (1U << (i % 8)));
    }
    return reply;
}

bool ModbusModule::store(std::uint8_t unit, const ModuleWrite& write) {
    const std::size_t first = write.coils ? 0 : first_output_register;
    const std::size_t count = write.coils ? coils : output_registers;
    if (write.address < first || write.address - first + write.values.size() > count) return false;
    Outputs& kept = outputs(unit);
    for (std::size_t i = 0; i < write.values.size(); ++i) {
        const std::size_t at = write.address - first + i;
        if (write.coils) {
            kept.coil[at] = write.values[i] != 0;
        } else {
            kept.register_value[at] = write.values[i];
        }
    }
    return true;
}

ModuleReply ModbusModule::write_one(const ModbusRequest& request) {
    if (request.pdu.size() != 5) return refused(request, ModbusException::illegal_value);
    const bool coil = request.pdu.front() == fc_write_coil;
    std::uint16_t value = word_at(request.pdu, 3);
    if (coil) {
        if (value != 0x0000 && value != 0xFF00) return refused(request, ModbusException::illegal_value);
        value = value == 0 ? 0 : 1;
    }
    ModuleWrite write{.coils = coil, .address = word_at(request.pdu, 1), .values = {value}};
    if (!store(request.unit, write)) return refused(request, ModbusException::illegal_address);
    return {.pdu = request.pdu, .words = {}, .write = std::move(write)};
}

ModuleReply ModbusModule::write_many(const ModbusRequest& request) {
    auto write = write_of(request.pdu);
    if (!write) return refused(request, ModbusException::illegal_value);
    if (!store(request.unit, *write)) return refused(request, ModbusException::illegal_address);
    return {
        .pdu = Bytes(request.pdu.begin(), request.pdu.begin() + 5), .words = {}, .write = std::move(write)};
}

}  // namespace thermbal
