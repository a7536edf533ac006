#include "serial_ports.hpp"

#include <fmt/format.h>

#include "columns.hpp"
#include "output.hpp"
#include "serial/ports.hpp"

namespace thermbal {
namespace {

using nlohmann::json;

std::string vid_pid(const PortInfo& port) {
    return port.usb_vid == 0 && port.usb_pid == 0 ? std::string()
                                                  : fmt::format("{:04x}:{:04x}", port.usb_vid, port.usb_pid);
}

json text_or_null(const std::string& text) {
    return text.empty() ? json(nullptr) : json(text);
}

}  // namespace

int run_ports(bool json_wanted) {
    const auto ports = list_ports();
    if (!ports) return report_error(ports.error());
    if (json_wanted) {
        json rows = json::array();
        for (const PortInfo& port : *ports) {
            rows.push_back({{"path", port.path},
                            {"by_id_path", text_or_null(port.by_id_path)},
                            {"usb", text_or_null(vid_pid(port))},
                            {"serial_number", text_or_null(port.serial)},
                            {"description", port.description}});
        }
        return print_json({{"ports", std::move(rows)}});
    }
    if (ports->empty()) return print_text("no serial ports: is the adapter plugged in? (see dmesg)\n");
    TextTable table({{"path"}, {"VID:PID"}, {"serial number"}, {"description"}, {"stays after replugging"}});
    const auto or_dash = [](const std::string& text) { return text.empty() ? std::string("-") : text; };
    for (const PortInfo& port : *ports) {
        table.add({port.path, or_dash(vid_pid(port)), or_dash(port.serial), or_dash(port.description),
                   or_dash(port.by_id_path)});
    }
    return print_text(table.str());
}

}  // namespace thermbal
