#include "rig.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <stdexcept>

#include <sys/eventfd.h>
#include <unistd.h>

namespace thermbal::soak {
namespace {

constexpr int look_every_ms = 1;

std::uint64_t mixed(std::uint64_t x) {  // splitmix64
    x += 0x9E3779B97F4A7C15U;
    x = (x ^ (x >> 30U)) * 0xBF58476D1CE4E5B9U;
    x = (x ^ (x >> 27U)) * 0x94D049BB133111EBU;
    return x ^ (x >> 31U);
}

std::vector<ModuleUnit> units_of(const Layout& layout) {
    std::vector<ModuleUnit> units;
    for (std::size_t u = 0; u < layout.units; ++u) {
        units.push_back({.id = static_cast<std::uint8_t>(u + 1),
                         .first_channel = u * layout.inputs_per_unit(),
                         .channels = layout.inputs_per_unit()});
    }
    return units;
}

template <typename T>
T checked(Result<T> result) {
    if (!result) throw std::runtime_error(result.error().message);
    return std::move(*result);
}

}  // namespace

std::int16_t plant_word(std::uint64_t seed, std::int64_t scan, std::size_t channel) {
    constexpr std::uint64_t words = 10000;  // -150.0 ... 849.9 C: good for the generic profile
    const std::uint64_t random =
        mixed(seed ^ mixed(static_cast<std::uint64_t>(scan) * most_channels + channel));
    return static_cast<std::int16_t>(static_cast<int>(random % words) - 1500);
}

Rig::Rig(Transport transport, Layout layout, std::uint64_t seed)
    : transport_(transport),
      layout_(layout),
      seed_(seed),
      looked_ns_(monotonic_ns()),
      station_(ModbusModule(*find_register_map("int16"), units_of(layout)),
               {.read_C = [this](double) { return measured_C(); }}, FaultPlan(), SimClock::scaled(1.0, 0),
               ForeignUnit::silence, {}, seed),
      turnaround_(seed),
      server_(
          std::make_unique<Server>([this](Framing framing, const ModbusRequest& request,
                                          std::int64_t now_ns) { return answer(framing, request, now_ns); })),
      stop_(eventfd(0, EFD_CLOEXEC)) {
    server_->watch_endpoint([this](std::int64_t now_ns) { return look(now_ns); }, look_every_ms);
    if (transport == Transport::tcp) {
        TcpEndpoint endpoint = checked(listen_on_loopback(0));
        port_ = endpoint.port;
        server_->listen(std::move(endpoint));
    } else {
        std::string pattern = (std::filesystem::temp_directory_path() / "thermbal-soak-XXXXXX").string();
        if (mkdtemp(pattern.data()) == nullptr) throw std::runtime_error("no scratch folder");
        folder_ = pattern;
        const auto attached = server_->attach([link = folder_ + "/module"] { return open_pty_line(link); });
        if (!attached) throw std::runtime_error(attached.error().message);
    }
    thread_ = std::thread([this] { serve(stop_.get()); });
}

Rig::~Rig() {
    eventfd_write(stop_.get(), 1);
    thread_.join();
    server_.reset();
    std::error_code ignored;
    if (!folder_.empty()) std::filesystem::remove_all(folder_, ignored);
}

void Rig::serve(int stop_fd) {
    const auto ended = server_->run(stop_fd);
    if (!ended) std::fprintf(stderr, "rig: %s\n", ended.error().message.c_str());
}

LinkOptions Rig::link_options(double response_timeout_s) const {
    LinkOptions options;
    options.name = "soak";
    options.transport = transport_;
    options.port = port_;
    options.device = folder_ + "/module";
    options.baud = 115200;
    options.response_timeout_s = response_timeout_s;
    options.connect_timeout_s = response_timeout_s;
    options.quiet_s = 0.005;
    options.first_pause_s = 0.005;
    options.longest_pause_s = 0.01;
    return options;
}

void Rig::begin_fault(const Fault& fault) {
    const std::lock_guard lock(mutex_);
    ++faults_begun_;
    disturbed_until_ns_ = std::numeric_limits<std::int64_t>::max();
    station_.plan().add(fault);
}

void Rig::end_faults() {
    const std::lock_guard lock(mutex_);
    station_.plan().clear();
}

EndpointState Rig::look(std::int64_t now_ns) {
    // A request that lay in the kernel while nobody looked is answered at the look after the next one.
    constexpr std::int64_t soon_ns = 4'000'000;
    worst_pause_ns_ = std::max(worst_pause_ns_.load(), now_ns - looked_ns_.exchange(now_ns));
    const std::lock_guard lock(mutex_);
    const EndpointState now = station_.endpoint(now_ns);
    const bool planned = !station_.plan().faults().empty();
    if (!planned && seen_ == EndpointState{} && !server_->busy() &&
        disturbed_until_ns_ == std::numeric_limits<std::int64_t>::max()) {
        disturbed_until_ns_ = now_ns + soon_ns;
    }
    seen_ = now;
    return now;
}

double Rig::worst_stall_s() const {
    const std::int64_t pause_ns = std::max(worst_pause_ns_.load(), monotonic_ns() - looked_ns_);
    return static_cast<double>(pause_ns - look_every_ms * 1'000'000) * 1e-9;
}

std::vector<Delivery> Rig::answer(Framing framing, const ModbusRequest& request, std::int64_t now_ns) {
    const std::lock_guard lock(mutex_);
    std::vector<Delivery> sent = station_.serve(framing, request, now_ns);
    // A real module takes its time; a fault that comes meanwhile finds the exchange half done. It takes one
    // request after the other: two that lay in the kernel while the host was busy are answered in order.
    const std::int64_t turnaround_ns = std::uniform_int_distribution(0, 2'000'000)(turnaround_);
    busy_until_ns_ = std::max(busy_until_ns_, now_ns) + turnaround_ns;
    const double answered_after_s = static_cast<double>(busy_until_ns_ - now_ns) * 1e-9;
    for (Delivery& delivery : sent) delivery.delay_s += answered_after_s;
    return sent;
}

std::vector<double> Rig::measured_C() const {
    std::vector<double> values(most_channels);
    for (std::size_t c = 0; c < most_channels; ++c) values[c] = plant_word(seed_, scan_, c) / 10.0;
    return values;
}

}  // namespace thermbal::soak
