#include <cerrno>
#include <cstdio>
#include <memory>
#include <system_error>
#include <tuple>

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/signalfd.h>

#include "manual/standard_streams.hpp"
#include "options.hpp"
#include "replay/recorded_scans.hpp"
#include "reports.hpp"
#include "simulator/control.hpp"
#include "simulator/endpoints.hpp"
#include "simulator/plant_source.hpp"
#include "simulator/server.hpp"
#include "simulator/spindle_head.hpp"
#include "simulator/station.hpp"
#include "simulator/truth.hpp"

namespace thermbal {
namespace {

using File = std::unique_ptr<std::FILE, int (*)(std::FILE*)>;

Result<File> open_file(const std::string& path, const char* mode) {
    File file(std::fopen(path.c_str(), mode), &std::fclose);
    if (file) return file;
    return fail(NextStep::stop,
                fmt::format("{}: cannot be written ({}); name a file in a folder that you may write to", path,
                            std::generic_category().message(errno)));
}

Result<void> print_truth(const SimulatorOptions& options) {
    const Result<Truth> truth = plant_truth(spindle_head(), options.room.mean_C, options.drive);
    if (!truth) return std::unexpected(truth.error());
    return print_out(options.json ? truth_json(options, *truth) : truth_table(options, *truth));
}

Result<void> write_recording(const SimulatorOptions& options) {
    const RecordedTest test = record_warm_up(Plant(spindle_head(), options.room, options.drive),
                                             options.noise, 15.0, options.duration_s);
    Result<File> file = open_file(options.csv_path, "wb");
    if (!file) return std::unexpected(file.error());
    const std::string text = recording_comments(options) + format_recorded_test(test);
    if (std::fwrite(text.data(), 1, text.size(), file->get()) == text.size() && std::fflush(file->get()) == 0)
        return {};
    return fail(NextStep::stop, fmt::format("{}: writing failed ({})", options.csv_path,
                                            std::generic_category().message(errno)));
}

ScanSource plant_source(const SimulatorOptions& options) {
    const auto source = std::make_shared<PlantSource>(Plant(spindle_head(), options.room, options.drive),
                                                      options.noise, options.spindle_start_s);
    return {.read_C = [source](double time_s) { return source->read_C(time_s); },
            .run_spindle = [source](double time_s, bool run) { source->run_spindle(time_s, run); }};
}

Result<ScanSource> recorded_source(const SimulatorOptions& options) {
    auto scans = RecordedScans::load(options.replay_path);
    if (!scans) return std::unexpected(scans.error());
    const auto recording = std::make_shared<RecordedScans>(std::move(*scans));
    const double start_s = options.spindle_start_s;
    return ScanSource{
        .read_C = [recording, start_s](double time_s) { return recording->at(time_s - start_s); }};
}

std::string hexadecimal(const std::vector<std::uint16_t>& words) {
    std::string text;
    for (const std::uint16_t word : words) text += fmt::format("{}{:04x}", text.empty() ? "" : " ", word);
    return text;
}

Result<std::function<void(const AnsweredRead&)>> truth_log(const std::string& path) {
    if (path.empty()) return [](const AnsweredRead&) {};
    Result<File> opened = open_file(path, "ab");
    if (!opened) return std::unexpected(opened.error());
    const std::shared_ptr<std::FILE> file = std::move(*opened);
    std::fseek(file.get(), 0, SEEK_END);
    if (std::ftell(file.get()) == 0) std::fputs("time_s,unit,function,address,fault,words\n", file.get());
    std::fflush(file.get());
    return [file](const AnsweredRead& read) {
        const std::string line = fmt::format("{:.6f},{},{},{},{},{}\n", read.time_s, read.unit, read.function,
                                             read.address, read.fault, hexadecimal(read.words));
        std::fputs(line.c_str(), file.get());
        std::fflush(file.get());
    };
}

void print_write(double time_s, std::uint8_t unit, const ModuleWrite& write) {
    for (std::size_t i = 0; i < write.values.size(); ++i) {
        // The module goes on when nobody takes what it says.
        std::ignore = print_out(fmt::format("wrote unit {} {} {} = {} at {:.3f} s\n", unit,
                                            write.coils ? "coil" : "holding register", write.address + i,
                                            write.values[i], time_s));
    }
}

Result<Station> station(const SimulatorOptions& options) {
    Result<ScanSource> source = plant_source(options);
    if (!options.replay_path.empty()) source = recorded_source(options);
    if (!source) return std::unexpected(source.error());
    auto log = truth_log(options.truth_log_path);
    if (!log) return std::unexpected(log.error());
    const SimClock clock =
        options.lockstep_s
            ? SimClock::lockstep(*options.lockstep_s)
            : SimClock::scaled(options.time_scale, options.time_epoch_ns.value_or(monotonic_ns()));
    return Station(ModbusModule(options.map, options.units), std::move(*source),
                   FaultPlan(options.faults, options.fault_reach()), clock, options.foreign_unit,
                   {.on_read = std::move(*log), .on_write = print_write}, options.noise.seed);
}

Result<void> announce(std::string_view event, const std::string& what) {
    return print_out(fmt::format("{} {}\n", event, what));
}

Result<void> open_endpoint(Server& server, const SimulatorOptions& options) {
    if (options.task == SimulatorTask::serve_tcp) {
        Result<TcpEndpoint> tcp = listen_on_loopback(options.port);
        if (!tcp) return std::unexpected(tcp.error());
        if (auto told = announce("ready", fmt::format("tcp {}", fmt::join(tcp->addresses, " "))); !told)
            return told;
        server.listen(std::move(*tcp));
        return {};
    }
    return server.attach([link_path = options.link_path, first = true]() mutable -> Result<PtyLine> {
        Result<PtyLine> line = open_pty_line(link_path);
        if (!line) return line;
        const auto told = announce(first ? "ready" : "plugged", fmt::format("rtu {}", line->port.path));
        if (!told && first) return std::unexpected(told.error());
        first = false;
        return line;
    });
}

Result<void> serve(const SimulatorOptions& options, int stop_fd) {
    Result<Station> module = station(options);
    if (!module) return std::unexpected(module.error());
    Server server([&module](Framing framing, const ModbusRequest& request, std::int64_t now_ns) {
        return module->serve(framing, request, now_ns);
    });
    // 2 ms is short against every period; without a planned fault of the endpoint only a command can change
    // it.
    server.watch_endpoint([&module](std::int64_t now_ns) { return module->endpoint(now_ns); },
                          module->plan().watches_endpoint() || !options.control_path.empty() ? 2 : 1000);
    std::optional<ControlSocket> control;
    if (!options.control_path.empty()) {
        auto opened = ControlSocket::open(options.control_path, [&module](std::string_view line) {
            return obey(line, module->plan(), module->next_s(monotonic_ns()));
        });
        if (!opened) return std::unexpected(opened.error());
        control.emplace(std::move(*opened));
        server.watch(control->fd(), [&control] { control->dispatch(); });
    }
    if (auto opened = open_endpoint(server, options); !opened) return opened;
    return server.run(stop_fd);
}

/// SIGTERM and SIGINT as a readable descriptor, so that the loop ends between two requests.
UniqueFd stop_signals() {
    signal(SIGPIPE, SIG_IGN);
    sigset_t signals;
    sigemptyset(&signals);
    sigaddset(&signals, SIGTERM);
    sigaddset(&signals, SIGINT);
    pthread_sigmask(SIG_BLOCK, &signals, nullptr);
    return UniqueFd(signalfd(-1, &signals, SFD_CLOEXEC));
}

Result<void> run(const SimulatorOptions& options) {
    switch (options.task) {
        case SimulatorTask::print_truth:
            return print_truth(options);
        case SimulatorTask::print_plant:
            return print_out(plant_json(options, spindle_head()));
        case SimulatorTask::write_csv:
            return write_recording(options);
        case SimulatorTask::serve_tcp:
        case SimulatorTask::serve_rtu:
            break;
    }
    const UniqueFd stop = stop_signals();
    return serve(options, stop.get());
}

}  // namespace
}  // namespace thermbal

// What nobody expects to be thrown ends the program with what it says.
// NOLINTNEXTLINE(bugprone-exception-escape)
int main(int argc, char** argv) {
    thermbal::keep_standard_streams();
    const thermbal::ParsedCommandLine command = thermbal::parse_command_line(argc, argv);
    if (!command.options) return command.exit_status;
    const thermbal::Result<void> done = thermbal::run(*command.options);
    if (done) return 0;
    thermbal::print_error_line("thermbal-sim: " + done.error().message);
    return done.error().next == thermbal::NextStep::refuse_input ? 2 : 1;
}
