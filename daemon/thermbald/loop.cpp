#include <algorithm>
#include <csignal>
#include <cstring>
#include <utility>

#include <fmt/format.h>
#include <malloc.h>
#include <spdlog/spdlog.h>
#include <sys/signalfd.h>

#include "compute/threads.hpp"
#include "config/load.hpp"
#include "daemon.hpp"
#include "service/notify.hpp"
#include "watches.hpp"

namespace thermbal {
namespace {

/// A scan whose line says nothing is closed this long after its period: the line's own bound ends before
/// that.
constexpr std::int64_t close_grace_ns = 20'000'000;

/// Three periods without anything from a line are no progress; a busy host is given some seconds.
std::int64_t longest_standstill_ns(const Config& config) {
    return static_cast<std::int64_t>((3.0 * config.test.period_s + 5.0) * 1e9);
}

std::vector<std::string> line_names(const Config& config) {
    std::vector<std::string> names;
    names.reserve(config.lines.size());
    for (const LineConfig& line : config.lines) names.push_back(line.link.name);
    return names;
}

Result<void> check(int code, std::string_view what) {
    if (code >= 0) return {};
    return fail(NextStep::stop, fmt::format("{}: {}", what, strerrordesc_np(-code)));
}

}  // namespace

Result<std::unique_ptr<Daemon>> Daemon::create(DaemonOptions options, Clock& clock) {
    const Config& config = options.config;
    // Nobody waits for a lock for longer than a scan may: what the store does not take now waits in memory.
    const std::int64_t period_ns = period_ns_of(config.test.period_s);
    const std::int64_t real_period_ns = clock.real_ns_until(clock.monotonic_ns() + period_ns);
    const StoreOptions store_options{
        .busy_timeout_ms = static_cast<int>(std::clamp<std::int64_t>(real_period_ns / 8'000'000, 10, 2000))};
    auto store = Store::open(config.store.path, {clock.wall_ns(), clock.monotonic_ns()}, store_options);
    if (!store) return std::unexpected(store.error());
    auto server = SocketServer::open(
        {.path = config.service.socket, .operators_group = config.service.operators_group});
    if (!server) return std::unexpected(server.error());
    auto hooks = HookRunner::create();
    if (!hooks) return std::unexpected(hooks.error());
    std::unique_ptr<Daemon> daemon(
        new Daemon(std::move(options), clock, std::move(*store), std::move(*server), std::move(*hooks)));
    if (auto attached = daemon->attach(); !attached) return std::unexpected(attached.error());
    return daemon;
}

Daemon::Daemon(DaemonOptions options, Clock& clock, Store store, SocketServer server, HookRunner hooks)
    : options_(std::move(options)),
      clock_(clock),
      storage_(std::move(store)),
      server_(std::move(server)),
      hooks_(std::move(hooks)),
      freeze_watch_(watched_modules(options_.config)),
      started_ns_(clock.monotonic_ns()),
      health_logged_ns_(started_ns_),
      progress_(line_names(options_.config), longest_standstill_ns(options_.config), real_monotonic_ns()) {
    newest_good_C_.assign(options_.config.channels.size(), no_value);
    for (std::size_t i = 0; i < options_.config.lines.size(); ++i) {
        lines_.push_back(std::make_unique<ModbusLine>(
            options_.config, i, real_monotonic_ns,
            [this](const std::string& message, bool trouble) { line_log_.push({message, trouble}); }));
    }
    const Config& config = options_.config;
    identifier_ = std::make_unique<Identifier>(
        [flow = std::optional<LiveFlow>(), options = std::shared_ptr<const FlowOptions>(),
         parallel = parallel_on_threads(config.identification.workers, true)](
            const IdentificationJob& job, const std::function<bool()>& cancelled) mutable {
            if (options != job.options) {
                options = job.options;
                flow.emplace(*options);
            }
            auto verdict = flow->identify(job.window, job.settled, parallel, cancelled);
            // What a long window took lies in holes between what is kept: a heap gives back its end alone.
            malloc_trim(0);
            return verdict;
        },
        [this](IdentificationResult result) { identifications_.push(std::move(result)); });
    comparer_ = std::make_unique<Comparer>(
        compare, [this](ComparisonResult result) { comparisons_.push(std::move(result)); });
    for (std::size_t i = 0; i < lines_.size(); ++i) {
        readers_.push_back(std::make_unique<LineReader>(i, *lines_[i], clock_, line_readings_));
    }
}

Daemon::~Daemon() {
    readers_.clear();
    identifier_.reset();
    comparer_.reset();
    for (sd_event_source* timer : {close_timer_, watchdog_timer_, stop_timer_}) sd_event_source_unref(timer);
    sd_event_unref(loop_);
}

Result<void> Daemon::attach() {
    if (auto made = check(sd_event_new(&loop_), "event loop"); !made) return made;
    const auto on_readable = [this](int fd, void (*handler)(Daemon&)) {
        // sd-event hands one pointer on; the handler's own address travels in a small closure that the loop
        // outlives.
        struct Closure {
            Daemon* daemon;
            void (*handler)(Daemon&);
        };
        auto* closure = new Closure{this, handler};
        sd_event_source* source = nullptr;
        const int added = sd_event_add_io(
            loop_, &source, fd, EPOLLIN,
            [](sd_event_source*, int, std::uint32_t, void* data) {
                const auto* self = static_cast<Closure*>(data);
                self->handler(*self->daemon);
                return 0;
            },
            closure);
        if (added < 0) {
            delete closure;
            return check(added, "event loop");
        }
        sd_event_source_set_destroy_callback(source, [](void* data) { delete static_cast<Closure*>(data); });
        sd_event_source_set_floating(source, 1);
        sd_event_source_unref(source);
        return Result<void>{};
    };
    // Scans first: what waits in the line's box is always older than what a client asks for.
    const std::pair<int, void (*)(Daemon&)> sources[] = {
        {line_readings_.fd(), [](Daemon& self) { self.on_line_readings(); }},
        {identifications_.fd(), [](Daemon& self) { self.on_identifications(); }},
        {comparisons_.fd(),
         [](Daemon& self) {
             for (const ComparisonResult& result : self.comparisons_.take()) self.take_comparison(result);
         }},
        {stop_outcomes_.fd(),
         [](Daemon& self) {
             for (const auto& outcome : self.stop_outcomes_.take()) self.take_stop_outcome(outcome);
         }},
        {line_log_.fd(),
         [](Daemon& self) {
             for (const LogLine& line : self.line_log_.take()) {
                 self.event(line.is_trouble ? "line_trouble" : "line_ok", line.message);
             }
         }},
        {file_checks_.fd(),
         [](Daemon& self) {
             for (const Result<bool>& sound : self.file_checks_.take()) self.take_file_check(sound);
         }},
        {server_.fd(), [](Daemon& self) { self.server_.dispatch(); }},
        {hooks_.fd(), [](Daemon& self) { self.hooks_.dispatch(); }},
    };
    for (const auto& [fd, handler] : sources) {
        if (auto added = on_readable(fd, handler); !added) return added;
    }
    for (const int signal : {SIGTERM, SIGINT}) {
        const auto leave = [](sd_event_source* source, const signalfd_siginfo*, void*) {
            return sd_event_exit(sd_event_source_get_event(source), 0);
        };
        if (auto added = check(sd_event_add_signal(loop_, nullptr, signal, leave, nullptr), "signals");
            !added) {
            return added;
        }
    }
    // Somebody's terminal that closes, or who expects it to read the configuration again: a test goes on.
    const auto go_on = [](sd_event_source*, const signalfd_siginfo*, void*) {
        spdlog::warn("SIGHUP: measuring goes on; a changed configuration is read at the next start");
        return 0;
    };
    if (auto added = check(sd_event_add_signal(loop_, nullptr, SIGHUP, go_on, nullptr), "signals"); !added)
        return added;
    add_methods();
    return {};
}

Result<void> Daemon::run() {
    auto resumed = take_up_test();
    if (!resumed && resumed.error().next == NextStep::stop) {
        leave_damaged_database();
        resumed = take_up_test();
    }
    if (!resumed) return std::unexpected(resumed.error());
    if (const auto& set_aside = storage_.store().set_aside()) {
        event("database_set_aside",
              fmt::format("the database was damaged; it is kept as {} and a new one is begun",
                          set_aside->string()));
    }
    if (*resumed) {
        go_on_with(**resumed);
    } else if (options_.config.test.start == TestConfig::Start::automatic) {
        auto plan = plan_of(nlohmann::json::object());
        if (!plan) return std::unexpected(plan.error());
        if (const auto id = start_test(std::move(*plan)); !id) return std::unexpected(id.error());
    } else {
        follow_grid({clock_.monotonic_ns(), period_ns_of(options_.config.test.period_s)}, 0);
    }
    notify_ready(is_measuring(test_.state) ? fmt::format("test {} is running", test_.id)
                                           : "no test is running");
    feed_watchdog();
    check_database();
    const auto ended = check(sd_event_loop(loop_), "event loop");
    leave_nothing_unstored();
    log_health();
    notify_stopping(is_measuring(test_.state) ? "the running test goes on at the next start" : "");
    return ended;
}

/// The last chance of what the database did not take.
void Daemon::leave_nothing_unstored() {
    storage_.flush();
    if (storage_.unstored_writes() == 0) return;
    spdlog::critical("{} scans that the database did not take are lost with this process: {}",
                     storage_.unstored_scans(), storage_.problem());
}

void Daemon::on_line_readings() {
    for (LineScan& reading : line_readings_.take()) {
        if (reading.generation == generation_) {
            lateness_ms_.add(
                static_cast<double>(reading.started_ns - assembler_->grid().due_ns(reading.scan)) * 1e-6);
        }
        progress_.line_delivered(reading.line, real_monotonic_ns());
        assembler_->add(std::move(reading));
    }
    close_overdue_scans();
}

/// After a standstill of days some at a time, so that nothing else waits for all of them.
void Daemon::close_overdue_scans() {
    constexpr std::size_t most_at_once = 200;
    const std::uint64_t generation = generation_;
    std::vector<Scan> closed = assembler_->take_closed(clock_.monotonic_ns() - close_grace_ns,
                                                       clock_.wall_ns() - close_grace_ns, most_at_once);
    for (Scan& scan : closed) {
        (scan.status == ScanStatus::missed ? scans_missed_
         : scan.status == ScanStatus::late ? scans_late_
                                           : scans_ok_)++;
        take_scan(scan);
        if (generation != generation_)
            break;  // a test began or ended on this scan: the others belong to the old grid
    }
    if (!closed.empty()) see_to_storage();
    leave_if_done();
    arm_close_timer();
}

void Daemon::see_to_storage() {
    storage_.flush();
    progress_.store_answered(real_monotonic_ns());
    if (storage_.damaged()) leave_damaged_database();
    tell_storage_news();
}

void Daemon::leave_if_done() {
    const bool has_ended = test_.id > 0 && !is_measuring(test_.state);
    if (options_.exit_when_ended && has_ended && !test_.stopping && hooks_.running() == 0)
        sd_event_exit(loop_, 0);
}

void Daemon::on_identifications() {
    for (IdentificationResult& result : identifications_.take()) take_identification(std::move(result));
}

/// A silent line must not hold the others: the oldest open scan is closed when its period is over.
void Daemon::arm_close_timer() {
    wake_after(close_timer_, clock_.real_ns_until(assembler_->next_close_ns() + close_grace_ns),
               on_time<&Daemon::close_overdue_scans>);
}

/// systemd hears from us only while every line and the store make progress.
void Daemon::feed_watchdog() {
    const auto interval = watchdog_interval();
    if (!interval) return;
    if (const auto standstill = progress_.standstill(real_monotonic_ns())) {
        spdlog::critical("the watchdog is not fed: {}", *standstill);
    } else {
        notify_watchdog();
    }
    wake_after(watchdog_timer_, std::chrono::nanoseconds(*interval).count(), on_time<&Daemon::feed_watchdog>);
}

void Daemon::wake_after(sd_event_source*& timer, std::int64_t wait_ns, sd_event_time_handler_t handler) {
    constexpr std::uint64_t accuracy_us = 1000;
    const std::uint64_t wait_us = static_cast<std::uint64_t>(std::max<std::int64_t>(wait_ns, 0)) / 1000 + 1;
    int set = 0;
    if (timer == nullptr) {
        set = sd_event_add_time_relative(loop_, &timer, CLOCK_BOOTTIME, wait_us, accuracy_us, handler, this);
    } else {
        set = sd_event_source_set_time_relative(timer, wait_us);
        if (set >= 0) set = sd_event_source_set_enabled(timer, SD_EVENT_ONESHOT);
    }
    if (set < 0) spdlog::critical("a timer of the event loop: {}", strerrordesc_np(-set));
}

/// Time may go on (for a clock that waits): the scan is stored, and identified where that was due.
void Daemon::settle(std::int64_t scan) {
    const bool is_stopping = test_.stopping && is_measuring(test_.state);
    if (test_.identifying || test_.comparing || is_stopping) return;
    if (assembler_) clock_.settled(assembler_->grid().due_ns(scan));
}

}  // namespace thermbal
