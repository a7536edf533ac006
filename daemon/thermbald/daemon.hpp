#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <systemd/sd-event.h>

#include "acquisition/alarm_watch.hpp"
#include "acquisition/clock.hpp"
#include "acquisition/freeze_watch.hpp"
#include "acquisition/line_reader.hpp"
#include "acquisition/mailbox.hpp"
#include "acquisition/scan.hpp"
#include "acquisition/time_watch.hpp"
#include "compute/comparison.hpp"
#include "compute/identifier.hpp"
#include "config/config.hpp"
#include "declaration/declarations.hpp"
#include "declaration/stop_rule.hpp"
#include "modbus_line.hpp"
#include "model_watch.hpp"
#include "progress.hpp"
#include "series/test_state.hpp"
#include "service/hooks.hpp"
#include "service/socket_server.hpp"
#include "statistics.hpp"
#include "store/file_check.hpp"
#include "store/store_queue.hpp"

namespace thermbal {

struct DaemonOptions {
    Config config;
    std::string version;
    /// Says which monotonic clock the stored times belong to: another boot is another clock.
    std::string boot_id;
    bool exit_when_ended = false;  ///< leave the event loop when a test has ended
};

/// The daemon: one event loop that owns the store, the socket and the test; a thread a line; a thread that
/// identifies. The live flow stands in take_scan and take_identification; everything else serves them.
class Daemon {
  public:
    /// Opens the database and the socket, takes up the test that was open when an earlier daemon ended,
    /// starts the lines. `clock` outlives the daemon.
    static Result<std::unique_ptr<Daemon>> create(DaemonOptions options, Clock& clock);
    ~Daemon();
    Daemon(const Daemon&) = delete;
    Daemon& operator=(const Daemon&) = delete;

    /// Until SIGTERM or SIGINT (a running test stays open and is taken up at the next start), or with
    /// exit_when_ended until the test has ended.
    Result<void> run();

  private:
    /// The machine has been asked to stop and has not yet.
    struct PendingStop {
        TestEvent how = TestEvent::stop;  ///< what becomes of the test
        std::int64_t give_up_ns = 0;      ///< on the host's own clock
        int attempts = 0;
    };

    /// The test under way, or the latest one.
    struct LiveTest {
        TestId id = 0;
        TestState state = TestState::idle;
        Grid grid;
        std::int64_t started_wall_ns = 0;
        std::string name;
        TestWindow window;
        Declarations declarations;
        StopDecision decision;
        std::int64_t last_scan = -1;
        std::optional<std::int64_t> identified_scan;  ///< newest window that was identified
        std::int64_t submitted_scan = 0;              ///< newest window given to the identifier
        std::int64_t revised_until_scan =
            -1;  ///< what was identified up to here saw samples taken back since
        double identification_s = 0.0;
        std::string end_reason;
        std::optional<PendingStop> stopping;
        std::string machine;
        std::shared_ptr<const FlowOptions> flow;
        std::string
            archive_dropped;  ///< why the archive does not speak for this test, once it was contradicted
        std::optional<ArchivedSpectrum> spectrum;
        double spectrum_window_min = 0.0;
        std::vector<KnownInput> inputs;   ///< as they are now
        std::optional<ModelWatch> model;  ///< empty: the test is compared with nothing
        bool identifying = false;         ///< a window is with the identifier
        bool comparing = false;           ///< a window is with the comparer
    };

    Daemon(DaemonOptions options, Clock& clock, Store store, SocketServer server, HookRunner hooks);

    // The live flow (daemon.cpp).
    void take_scan(Scan& scan);
    void take_identification(IdentificationResult result);
    void grow_window(const Scan& scan);
    bool identification_is_due(std::int64_t scan) const;
    void record_changes(const std::vector<DeclarationChange>& changes, std::int64_t window_end_scan);
    void decide();
    void act_on_declaration();
    void end_test(TestEvent how, const std::string& reason);
    bool over_time(const Scan& scan) const;
    void raise_alarm(const Scan& scan);

    // What a scan says about the modules and the host (watches.cpp).
    void watch_modules(Scan& scan);
    void watch_time(const Scan& scan);
    void take_back(const WatchedModule& module, std::int64_t first_scan, std::int64_t last_scan);

    // Starting and resuming (tests.cpp).
    /// What a test is begun with; the configuration's [test] has the defaults.
    struct TestPlan {
        std::string name, machine;
        std::vector<KnownInput> inputs;
        std::optional<TestModel> model;
    };
    Result<TestPlan> plan_of(const nlohmann::json& params) const;
    Result<TestId> start_test(TestPlan plan);
    TestRecord test_record(const std::string& name, const std::string& machine, const TestModel* model) const;
    Result<std::optional<ResumedTest>> take_up_test();
    Result<void> restore(const ResumedTest& resumed);
    void go_on_with(const ResumedTest& resumed);
    void resume_model(const TestRecord& record);
    void set_input(const KnownInput& input);
    void follow_grid(Grid grid, std::int64_t first_scan);
    void begin_window(double period_s);
    void prepare_flow(const std::string& machine);
    void archive_test();

    // Simulation against measurement (comparison.cpp).
    void compare_with_model(std::int64_t scan);
    void take_comparison(const ComparisonResult& result);

    // The stop action (stop_action.cpp).
    /// The test ends when the machine has stopped, or when people have been told that it has not.
    void stop_machine_and_end(TestEvent how, const std::string& reason);
    void ask_to_stop();
    void run_stop_command();
    void take_stop_outcome(const Result<void>& outcome);
    void end_stopping();

    // Storing, events (recording.cpp).
    void store_scan(const Scan& scan);
    void write(StoreQueue::Write write, std::string_view key = {});
    void tell_storage_news();
    void leave_damaged_database();
    void check_database();
    void take_file_check(const Result<bool>& sound);
    void event(std::string_view kind, const std::string& message,
               const std::optional<std::string>& channel = {});
    ScanRecord record_of(const Scan& scan) const;
    Moment now() const;

    // The socket's methods (requests.cpp).
    void add_methods();
    Result<nlohmann::json> status_json() const;
    Result<nlohmann::json> channels_json() const;
    Result<nlohmann::json> samples_json(const nlohmann::json& params) const;
    Result<nlohmann::json> curve_json(const nlohmann::json& params) const;
    Result<nlohmann::json> predictions_json() const;
    Result<nlohmann::json> events_json(const nlohmann::json& params) const;
    Result<nlohmann::json> health_json() const;
    void log_health();
    void log_health_hourly();
    Result<nlohmann::json> on_start(const nlohmann::json& params);
    Result<nlohmann::json> on_stop(const nlohmann::json& params);
    Result<nlohmann::json> on_annotate(const nlohmann::json& params);
    Result<nlohmann::json> on_set_inputs(const nlohmann::json& params);
    const ChannelVerdict* verdict_of(const std::string& channel) const;

    // The event loop (loop.cpp).
    Result<void> attach();
    void on_line_readings();
    void on_identifications();
    void close_overdue_scans();
    void arm_close_timer();
    void see_to_storage();
    void leave_if_done();
    void feed_watchdog();
    /// Once, so long from now; what the same timer was set to before is forgotten.
    void wake_after(sd_event_source*& timer, std::int64_t wait_ns, sd_event_time_handler_t handler);
    template <void (Daemon::*Handler)()>
    static int on_time(sd_event_source* /*timer*/, std::uint64_t /*usec*/, void* self) {
        (static_cast<Daemon*>(self)->*Handler)();
        return 0;
    }
    void leave_nothing_unstored();
    void settle(std::int64_t scan);

    DaemonOptions options_;
    Clock& clock_;
    StoreQueue storage_;
    SocketServer server_;
    HookRunner hooks_;
    LiveTest test_;
    std::optional<Scan> latest_;  ///< newest scan, in a test or not
    std::vector<double> newest_good_C_;
    FreezeWatch freeze_watch_;
    TimeWatch time_watch_;
    std::optional<AlarmWatch> alarm_watch_;  ///< of the test
    std::uint64_t generation_ = 0;
    std::optional<ScanAssembler> assembler_;
    RecentFigures lateness_ms_, commit_ms_, identification_s_, comparison_s_;
    std::uint64_t scans_ok_ = 0, scans_late_ = 0, scans_missed_ = 0;
    std::int64_t started_ns_ = 0;
    std::int64_t health_logged_ns_ = 0;
    Progress progress_;

    sd_event* loop_ = nullptr;
    sd_event_source* close_timer_ = nullptr;
    sd_event_source* watchdog_timer_ = nullptr;
    sd_event_source* stop_timer_ = nullptr;

    Mailbox<LineScan> line_readings_;
    Mailbox<IdentificationResult> identifications_;
    Mailbox<ComparisonResult> comparisons_;
    Mailbox<Result<void>> stop_outcomes_;
    struct LogLine {
        std::string message;
        bool is_trouble;
    };
    Mailbox<LogLine> line_log_;
    Mailbox<Result<bool>> file_checks_;
    std::optional<FileCheck> file_check_;
    std::optional<std::int64_t> left_database_ns_;  ///< when a damaged database was set aside, or that failed
    std::vector<std::unique_ptr<ModbusLine>> lines_;
    std::unique_ptr<Identifier> identifier_;            // its thread uses the mailboxes above
    std::unique_ptr<Comparer> comparer_;                // and so does this one's
    std::vector<std::unique_ptr<LineReader>> readers_;  // last: their threads use lines and mailboxes
};

}  // namespace thermbal
