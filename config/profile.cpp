#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "config/load.hpp"
#include "series/temperature.hpp"
#include "toml_reader.hpp"

namespace thermbal {
namespace {

struct NumberRange {
    double low;
    double high;
    double bit_patterns;  ///< how many values the register has; 0: no bit pattern is taken
};

NumberRange range_of(RegisterType type) {
    switch (type) {
        case RegisterType::int16:
            return {-32768.0, 32767.0, 65536.0};
        case RegisterType::uint16:
            return {0.0, 65535.0, 0.0};
        case RegisterType::int32:
            return {-2147483648.0, 2147483647.0, 4294967296.0};
        case RegisterType::uint32:
            return {0.0, 4294967295.0, 0.0};
        case RegisterType::float32:
            return {-3.5e38, 3.5e38, 0.0};
    }
    return {0.0, 0.0, 0.0};
}

/// Data sheets print the code of a signed register as a number (-32768) or as its bits (0x8000): both are
/// taken.
std::optional<double> fault_number(TableReader& reader, std::string_view key, RegisterType type) {
    const auto number = reader.register_number(key);
    if (!number) return std::nullopt;
    const NumberRange range = range_of(type);
    if (*number >= range.low && *number <= range.high) return number;
    if (*number > range.high && *number < range.bit_patterns) return *number - range.bit_patterns;
    reader.complain(key, fmt::format("found {}; accepted: what a register of type {} can hold", *number,
                                     to_string(type)));
    return std::nullopt;
}

std::optional<Quality> fault_quality(TableReader& reader, std::string_view key) {
    constexpr Quality qualities[] = {Quality::open, Quality::shorted, Quality::over_range,
                                     Quality::under_range, Quality::stale};
    const auto chosen = reader.choice(
        key, {to_string(Quality::open), to_string(Quality::shorted), to_string(Quality::over_range),
              to_string(Quality::under_range), to_string(Quality::stale)});
    return chosen ? std::optional(qualities[*chosen]) : std::nullopt;
}

std::optional<FaultCode> read_fault(TableReader& reader, RegisterType type) {
    const bool one = reader.has("number");
    if (one == (reader.has("from") || reader.has("to"))) {
        reader.complain("number", "accepted: either number, or from and to");
    }
    reader.require("quality", "\"open\", \"short\", \"over_range\", \"under_range\" or \"stale\"");
    const auto first = fault_number(reader, one ? "number" : "from", type);
    const auto last = one ? first : fault_number(reader, "to", type);
    const auto quality = fault_quality(reader, "quality");
    for (const char* key : {"number", "from", "to"}) reader.register_number(key);
    reader.finish();
    if (!first || !last || !quality) return std::nullopt;
    return FaultCode{.first = *first, .last = *last, .quality = *quality};
}

void read_map(TableReader& reader, ModuleProfile& profile) {
    reader.require("source", "where the facts of this profile come from");
    reader.require("inputs", "how many inputs the module has");
    set(profile.name, reader.text("name"));
    set(profile.source, reader.text("source"));
    set(profile.function, reader.integer("function", {3, 4}));
    set(profile.first_register, reader.integer("first_register", {0, 65535}));
    set(profile.inputs, reader.integer("inputs", {1, 256}));
    if (const auto type = reader.text("type")) {
        const auto known = register_type_from_string(*type);
        if (known)
            profile.type = *known;
        else
            reader.complain(
                "type", fmt::format("found \"{}\"; accepted: int16, uint16, int32, uint32, float32", *type));
    }
    profile.stride = registers_per_value(profile.type);
    set(profile.stride, reader.integer("stride", {1, 65535}));
    if (const auto order = reader.text("byte_order")) {
        const auto known = byte_order_from_string(*order);
        if (known)
            profile.byte_order = *known;
        else
            reader.complain("byte_order",
                            fmt::format("found \"{}\"; accepted: abcd, cdab, badc, dcba", *order));
    }
    set(profile.scale, reader.number("scale", any_number));
    set(profile.offset_C, reader.number("offset_C", any_number));
    set(profile.valid_min_C, reader.number("valid_min_C", {absolute_zero_C, hottest_reading_C}));
    set(profile.valid_max_C, reader.number("valid_max_C", {absolute_zero_C, hottest_reading_C}));
    set(profile.nan_quality, fault_quality(reader, "nan"));
}

TypeCode read_type_code(const toml::table& table, Complaints& complaints) {
    TableReader reader(table, "type_code", complaints);
    TypeCode code;
    reader.require("first_register", "the register that holds the type of input 1");
    reader.require("accepted", "a list: the codes of the sensors that this profile reads");
    set(code.function, reader.integer("function", {3, 4}));
    set(code.first_register, reader.integer("first_register", {0, 65535}));
    set(code.stride, reader.integer("stride", {0, 65535}));
    set(code.accepted, reader.integers("accepted", {0, 65535}));
    reader.finish();
    return code;
}

}  // namespace

Result<ModuleProfile> load_profile(std::string_view toml, std::string_view file_name) {
    Complaints complaints(file_name);
    const auto root = parse_toml(toml, complaints);
    if (!root) return std::unexpected(complaints.error());
    ModuleProfile profile;
    TableReader reader(*root, "", complaints);
    read_map(reader, profile);
    if (const toml::table* table = reader.table("type_code")) {
        profile.type_code = read_type_code(*table, complaints);
    }
    for (const toml::table* table : reader.tables("fault")) {
        TableReader fault_reader(*table, "fault", complaints);
        if (const auto fault = read_fault(fault_reader, profile.type)) profile.faults.push_back(*fault);
    }
    reader.finish();
    if (complaints.empty()) {
        const std::string complaint = check_profile(profile);
        if (!complaint.empty()) complaints.add(root->source(), "", complaint);
    }
    if (!complaints.empty()) return std::unexpected(complaints.error());
    return profile;
}

std::string explain_profile(const ModuleProfile& profile) {
    std::string text = fmt::format(
        "name = {}\nsource = {}\nfunction = {}\nfirst_register = {}\ninputs = {}\nstride = {}\ntype = "
        "\"{}\"\n"
        "byte_order = \"{}\"\nscale = {}\noffset_C = {}\nvalid_min_C = {}\nvalid_max_C = {}\nnan = \"{}\"\n",
        toml_quoted(profile.name), toml_quoted(profile.source), profile.function, profile.first_register,
        profile.inputs, profile.stride, to_string(profile.type), to_string(profile.byte_order), profile.scale,
        profile.offset_C, profile.valid_min_C, profile.valid_max_C, to_string(profile.nan_quality));
    if (profile.type_code) {
        const TypeCode& code = *profile.type_code;
        text +=
            fmt::format("\n[type_code]\nfunction = {}\nfirst_register = {}\nstride = {}\naccepted = [{}]\n",
                        code.function, code.first_register, code.stride, fmt::join(code.accepted, ", "));
    }
    for (const FaultCode& fault : profile.faults) {
        text += fmt::format("\n[[fault]]\nfrom = {}\nto = {}\nquality = \"{}\"\n", fault.first, fault.last,
                            to_string(fault.quality));
    }
    return text;
}

}  // namespace thermbal
