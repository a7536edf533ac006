#include <algorithm>
#include <filesystem>
#include <map>
#include <memory>
#include <system_error>

#include <fmt/format.h>
#include <libserialport.h>

#include "serial/ports.hpp"

namespace thermbal {
namespace {

namespace fs = std::filesystem;

struct FreePortList {
    void operator()(sp_port** list) const { sp_free_port_list(list); }
};

std::string text_or_empty(const char* text) {
    return text == nullptr ? std::string() : std::string(text);
}

/// Device path to its stable name, as udev keeps it.
std::map<std::string, std::string> by_id_paths() {
    std::map<std::string, std::string> paths;
    std::error_code error;
    for (fs::directory_iterator entry("/dev/serial/by-id", error), end; !error && entry != end;
         entry.increment(error)) {
        std::error_code dangling;
        const fs::path device = fs::canonical(entry->path(), dangling);
        if (!dangling) paths[device.string()] = entry->path().string();
    }
    return paths;
}

PortInfo info_of(const sp_port* port, const std::map<std::string, std::string>& by_id) {
    PortInfo info;
    info.path = text_or_empty(sp_get_port_name(port));
    info.description = text_or_empty(sp_get_port_description(port));
    int vid = 0;
    int pid = 0;
    if (sp_get_port_usb_vid_pid(port, &vid, &pid) == SP_OK) {
        info.usb_vid = vid;
        info.usb_pid = pid;
        info.serial = text_or_empty(sp_get_port_usb_serial(port));
    }
    if (const auto found = by_id.find(info.path); found != by_id.end()) info.by_id_path = found->second;
    return info;
}

}  // namespace

Result<std::vector<PortInfo>> list_ports() {
    std::error_code error;
    // libserialport fails where the kernel has no tty class at all (a container): that is no port, not a
    // fault.
    if (!fs::exists("/sys/class/tty", error)) return std::vector<PortInfo>{};
    sp_port** raw = nullptr;
    if (sp_list_ports(&raw) != SP_OK) {
        return fail(NextStep::retry, fmt::format("the serial ports cannot be listed: {}",
                                                 std::generic_category().message(sp_last_error_code())));
    }
    const std::unique_ptr<sp_port*, FreePortList> list(raw);
    const auto by_id = by_id_paths();
    std::vector<PortInfo> ports;
    for (sp_port** port = list.get(); *port != nullptr; ++port) ports.push_back(info_of(*port, by_id));
    std::ranges::sort(ports, {}, &PortInfo::path);
    return ports;
}

}  // namespace thermbal
