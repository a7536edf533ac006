#include <algorithm>
#include <array>
#include <memory>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "daemon.hpp"

namespace thermbal {

namespace {

/// A log that is kept to warnings still says what somebody has to see to.
spdlog::level::level_enum level_of(std::string_view kind) {
    static constexpr std::array errors = {"alarm", "aborted", "stop_failed"};
    static constexpr std::array warnings = {"line_trouble",       "frozen",       "storage_away",
                                            "storage_refused",    "scans_missed", "clock_step",
                                            "database_set_aside", "held",         "model_failed",
                                            "archive_unread",     "suspended",    "database_unchecked"};
    if (std::ranges::find(errors, kind) != errors.end()) return spdlog::level::err;
    return std::ranges::find(warnings, kind) != warnings.end() ? spdlog::level::warn : spdlog::level::info;
}

/// What a person wrote makes no further lines of the log.
std::string as_one_line(std::string text) {
    std::ranges::replace_if(
        text, [](unsigned char character) { return character < ' ' || character == 0x7f; }, ' ');
    return text;
}

}  // namespace

Moment Daemon::now() const {
    return {clock_.wall_ns(), clock_.monotonic_ns()};
}

ScanRecord Daemon::record_of(const Scan& scan) const {
    ScanRecord record{scan.scan,    scan.status,  test_.grid.time_s(scan.scan),
                      scan.due_ns,  {},           {},
                      scan.wall_ns, scan.samples, {}};
    if (scan.status != ScanStatus::missed) {
        record.started_ns = scan.started_ns;
        record.finished_ns = scan.finished_ns;
        for (const KnownInput& input : test_.inputs) record.inputs.push_back({input.name, input.value});
    }
    return record;
}

void Daemon::store_scan(const Scan& scan) {
    const std::int64_t started_ns = real_monotonic_ns();
    storage_.append_scan(test_.id, record_of(scan));
    if (storage_.problem().empty() && scan.status != ScanStatus::missed) {
        commit_ms_.add(static_cast<double>(real_monotonic_ns() - started_ns) * 1e-6);
    }
}

void Daemon::write(StoreQueue::Write write, std::string_view key) {
    storage_.write(std::move(write), key);
}

/// At once, not at the next start: a test runs for hours, and what a damaged file does not take has only the
/// memory to wait in. Not again and again on a disk that spoils every file: what fails or comes too early is
/// tried again at a later scan.
void Daemon::leave_damaged_database() {
    constexpr std::int64_t pause_ns = 600'000'000'000;
    if (left_database_ns_ && real_monotonic_ns() - *left_database_ns_ < pause_ns) return;
    left_database_ns_ = real_monotonic_ns();
    KnownTest known;
    if (test_.id > 0) {
        known = {
            .id = test_.id,
            .record = test_record(test_.name, test_.machine, test_.model ? &test_.model->model() : nullptr),
            .state = test_.state,
            .reason = test_.end_reason,
            .before_scan = test_.last_scan + 1};
        known.record.started = {test_.started_wall_ns, test_.grid.start_ns};
        known.record.period_s = test_.window.period_s;
    } else if (const auto open = storage_.store().read().open_test(); open && *open) {
        known = {.id = (*open)->id,
                 .record = (*open)->record,
                 .state = (*open)->state,
                 .reason = (*open)->stop_reason,
                 .before_scan = (*open)->last_scan.value_or(-1) + 1};
    }
    // A check that still runs reads the file that is set aside now.
    if (storage_.begin_anew(std::move(known), now())) file_check_.reset();
}

/// A large file was not read through before the first scan; it is, beside the scans.
void Daemon::check_database() {
    if (storage_.store().checked()) return;
    file_check_.emplace(options_.config.store.path,
                        [this](Result<bool> sound) { file_checks_.push(std::move(sound)); });
}

void Daemon::take_file_check(const Result<bool>& sound) {
    if (!file_check_) return;
    file_check_.reset();
    if (!sound) {
        event("database_unchecked",
              fmt::format("the database could not be looked through for damage: {}", sound.error().message));
    } else if (!*sound) {
        storage_.note_damage();
        leave_damaged_database();
        tell_storage_news();
    }
}

void Daemon::tell_storage_news() {
    for (const StorageNews& news : storage_.take_news()) {
        switch (news.kind) {
            case StorageNews::Kind::away:
                event("storage_away", news.message);
                break;
            case StorageNews::Kind::back:
                event("storage_back", news.message);
                break;
            case StorageNews::Kind::refused:
                event("storage_refused", news.message);
                break;
            case StorageNews::Kind::set_aside:
                event("database_set_aside", news.message);
                break;
        }
    }
}

void Daemon::event(std::string_view kind, const std::string& message,
                   const std::optional<std::string>& channel) {
    EventRecord record{.id = 0,
                       .test_id = test_.id > 0 ? std::optional(test_.id) : std::nullopt,
                       .wall_ns = clock_.wall_ns(),
                       .time_s = {},
                       .kind = std::string(kind),
                       .channel = channel,
                       .message = message};
    if (record.test_id)
        record.time_s = static_cast<double>(clock_.monotonic_ns() - test_.grid.start_ns) * 1e-9;
    spdlog::log(level_of(kind), "{}: {}", kind, as_one_line(message));
    // Shared with a write that may happen long after this call; 0 until then.
    const auto id = std::make_shared<std::int64_t>(0);
    write([record, id](Store& store) -> Result<void> {
        const auto stored = store.record_event(record);
        if (!stored) return std::unexpected(stored.error());
        *id = *stored;
        return {};
    });
    server_.publish("event",
                    {{"id", *id},
                     {"kind", kind},
                     {"time_s", record.time_s ? nlohmann::json(*record.time_s) : nlohmann::json(nullptr)},
                     {"channel", channel ? nlohmann::json(*channel) : nlohmann::json(nullptr)},
                     {"message", message}});
}

}  // namespace thermbal
