#include "store/reader.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <sys/statvfs.h>

#include "rows.hpp"
#include "schema.hpp"
#include "sqlite.hpp"

namespace thermbal {

namespace {

// Beyond this a scan number is damage, not a test: four years of scans every 15 s.
constexpr std::int64_t most_scans = 10'000'000;

constexpr std::string_view test_columns =
    "SELECT id, name, machine, config_toml, version, period_s, keep_measuring, state, started_wall_ns, "
    "started_monotonic_ns, boot_id, ended_wall_ns, ended_monotonic_ns, stop_reason, model_toml, model_file, "
    "(SELECT max(scan) FROM scans WHERE test_id = tests.id) FROM tests ";

StoredTest test_in(const sqlite::Statement& row) {
    StoredTest test;
    test.id = row.integer(0);
    test.record.name = row.text(1);
    test.record.machine = row.text(2);
    test.record.config_toml = row.text(3);
    test.record.version = row.text(4);
    test.record.period_s = row.real(5);
    test.record.keep_measuring = row.integer(6) != 0;
    test.state = test_state_from_string(row.text(7)).value_or(TestState::aborted);
    test.record.started = {row.integer(8), row.integer(9)};
    test.record.boot_id = row.text(10);
    if (!row.null(11)) test.ended = Moment{row.integer(11), row.integer(12)};
    test.stop_reason = row.text(13);
    test.record.model_toml = row.text(14);
    test.record.model_file = row.text(15);
    test.last_scan = row.optional_integer(16);
    return test;
}

Result<std::vector<ChannelRecord>> channels_of(sqlite::Database& database, TestId id) {
    std::vector<ChannelRecord> channels;
    auto rows = database.query(
        "SELECT name, role, place, required, source, calibration FROM channels WHERE test_id = ? ORDER BY "
        "position",
        id);
    while (rows.next())
        channels.push_back(
            {rows.text(0), rows.text(1), rows.text(2), rows.integer(3) != 0, rows.text(4), rows.text(5)});
    if (auto status = rows.status(); !status) return std::unexpected(status.error());
    return channels;
}

template <typename... Values>
Result<std::vector<StoredTest>> tests_where(sqlite::Database& database, std::string_view clause,
                                            const Values&... values) {
    sqlite::Transaction snapshot(database, sqlite::Transaction::Kind::read);
    if (!snapshot.begun()) return std::unexpected(snapshot.begun().error());
    std::vector<StoredTest> tests;
    auto rows = database.query(std::string(test_columns) + std::string(clause), values...);
    while (rows.next()) tests.push_back(test_in(rows));
    if (auto status = rows.status(); !status) return std::unexpected(status.error());
    for (auto& test : tests) {
        auto channels = channels_of(database, test.id);
        if (!channels) return std::unexpected(channels.error());
        test.record.channels = std::move(*channels);
    }
    return tests;
}

Result<std::optional<StoredTest>> first(Result<std::vector<StoredTest>> tests) {
    if (!tests) return std::unexpected(tests.error());
    if (tests->empty()) return std::optional<StoredTest>{};
    return std::optional(std::move(tests->front()));
}

/// Calls `take(row)` for each row of one scan, from a statement ordered by scan that is shared by all of
/// them.
class RowsByScan {
  public:
    explicit RowsByScan(sqlite::Statement rows) : rows_(std::move(rows)) { more_ = rows_.next(); }

    template <typename Take>
    void of(std::int64_t scan, const Take& take) {
        for (; more_ && rows_.integer(0) <= scan; more_ = rows_.next())
            if (rows_.integer(0) == scan) take(rows_);
    }
    Result<void> status() const { return rows_.status(); }

  private:
    sqlite::Statement rows_;
    bool more_ = false;
};

Sample sample_in(const sqlite::Statement& row, int first_column) {
    Sample sample;
    if (!row.null(first_column)) sample.raw = static_cast<std::uint32_t>(row.integer(first_column));
    sample.value_C = row.real(first_column + 1);
    sample.quality = quality_from_string(row.text(first_column + 2)).value_or(Quality::gap);
    sample.source_C = row.real(first_column + 3);
    return sample;
}

std::vector<Column> empty_columns(const std::vector<std::string>& names, std::size_t length) {
    std::vector<Column> columns;
    columns.reserve(names.size());
    for (const auto& name : names) columns.push_back({name, std::vector<double>(length, no_value)});
    return columns;
}

std::vector<std::string> names_of(const std::vector<ChannelRecord>& channels) {
    std::vector<std::string> names;
    names.reserve(channels.size());
    for (const auto& channel : channels) names.push_back(channel.name);
    return names;
}

Result<std::vector<std::string>> input_names(sqlite::Database& database, TestId id, std::int64_t until_scan) {
    std::vector<std::string> names;
    auto rows = database.query(
        "SELECT name FROM inputs WHERE test_id = ? AND scan <= ? GROUP BY name ORDER BY min(scan), name", id,
        until_scan);
    while (rows.next()) names.push_back(rows.text(0));
    if (auto status = rows.status(); !status) return std::unexpected(status.error());
    return names;
}

Column* find(std::vector<Column>& columns, std::string_view name) {
    for (auto& column : columns)
        if (column.name == name) return &column;
    return nullptr;
}

void hold_last_value(Column& column) {
    double last = no_value;
    for (double& value : column.values) {
        if (std::isfinite(value)) last = value;
        value = last;
    }
}

/// What recorded_test and window share: the good values of a test in the rows that `row_of(scan)` gives them;
/// a scan that it gives none has values without being a scan (`stop`).
template <typename RowOf>
Result<void> fill_columns(sqlite::Database& database, TestId id, std::int64_t until_scan, const RowOf& row_of,
                          std::vector<Column>& channels, std::vector<Column>& inputs) {
    const auto place_of = [&](Column& column, std::int64_t scan) -> Result<double*> {
        const std::optional<std::size_t> row = row_of(scan);
        if (row && *row < column.values.size()) return &column.values[*row];
        return fail(
            NextStep::stop,
            fmt::format("database {}: test {} has values of scan {}, which is not there: damaged; run verify",
                        database.path().string(), id, scan));
    };
    auto samples = database.query(
        "SELECT scan, channel, value_C FROM samples WHERE test_id = ? AND scan <= ? AND quality = 'good'", id,
        until_scan);
    while (samples.next()) {
        const auto channel = static_cast<std::size_t>(samples.integer(1));
        if (channel >= channels.size()) continue;
        const auto place = place_of(channels[channel], samples.integer(0));
        if (!place) return std::unexpected(place.error());
        **place = samples.real(2);
    }
    if (auto status = samples.status(); !status) return status;

    auto values = database.query("SELECT scan, name, value FROM inputs WHERE test_id = ? AND scan <= ?", id,
                                 until_scan);
    while (values.next()) {
        auto* column = find(inputs, values.text(1));
        if (column == nullptr) continue;
        const auto place = place_of(*column, values.integer(0));
        if (!place) return std::unexpected(place.error());
        **place = values.real(2);
    }
    return values.status();
}

IdentificationRecord identification_in(const sqlite::Statement& row) {
    return {row.text(0), row.integer(1), row.integer(2), row.text(3)};
}

/// Nobody can write there, and nothing has: without its shared memory a WAL cannot be read, and there is
/// nothing in it. With it, the medium may be read-only for us alone (a sandbox), and a daemon writes.
bool cannot_change(const std::filesystem::path& path) {
    struct statvfs medium{};
    std::error_code error;
    return statvfs(path.c_str(), &medium) == 0 && (medium.f_flag & ST_RDONLY) != 0 &&
           !std::filesystem::exists(path.string() + "-shm", error);
}

}  // namespace

Reader::Reader(std::shared_ptr<sqlite::Database> database) : database_(std::move(database)) {}
Reader::Reader(Reader&&) noexcept = default;
Reader& Reader::operator=(Reader&&) noexcept = default;
Reader::~Reader() = default;

Result<Reader> Reader::open(const std::filesystem::path& path) {
    std::error_code error;
    if (!std::filesystem::is_regular_file(path, error))
        return fail(NextStep::refuse_input, fmt::format("database {}: no such file", path.string()));
    const auto mode = cannot_change(path) ? sqlite::OpenMode::read_only_medium : sqlite::OpenMode::read_only;
    auto database = sqlite::Database::open(path, mode, 2000);
    if (!database) return std::unexpected(database.error());
    if (auto ours = check_schema(**database, false); !ours) return std::unexpected(ours.error());
    return Reader(std::move(*database));
}

const std::filesystem::path& Reader::path() const {
    return database_->path();
}

Result<std::vector<StoredTest>> Reader::tests(std::int64_t most) const {
    return tests_where(*database_, "ORDER BY id DESC LIMIT ?", most);
}

Result<StoredTest> Reader::test(TestId id) const {
    auto found = first(tests_where(*database_, "WHERE id = ?", id));
    if (!found) return std::unexpected(found.error());
    if (!*found)
        return fail(NextStep::refuse_input,
                    fmt::format("database {}: there is no test {}", database_->path().string(), id));
    return std::move(**found);
}

Result<std::optional<StoredTest>> Reader::open_test() const {
    return first(tests_where(*database_, "WHERE state IN ('running', 'declared')"));
}

Result<std::optional<StoredTest>> Reader::newest_test() const {
    return first(tests_where(*database_, "ORDER BY id DESC LIMIT 1"));
}

Result<std::vector<ScanRecord>> Reader::scans(TestId id, std::int64_t from_scan, std::int64_t to_scan) const {
    std::vector<ScanRecord> scans;
    const auto read =
        each_scan(id, from_scan, to_scan, [&scans](ScanRecord& scan) { scans.push_back(std::move(scan)); });
    if (!read) return std::unexpected(read.error());
    return scans;
}

Result<void> Reader::each_scan(TestId id, std::int64_t from_scan, std::int64_t to_scan,
                               const std::function<void(ScanRecord& scan)>& take) const {
    sqlite::Transaction snapshot(*database_, sqlite::Transaction::Kind::read);
    if (!snapshot.begun()) return snapshot.begun();
    auto rows = database_->query(
        "SELECT scan, status, time_s, scheduled_ns, started_ns, finished_ns, wall_ns FROM scans "
        "WHERE test_id = ? AND scan BETWEEN ? AND ? ORDER BY scan",
        id, from_scan, to_scan);
    RowsByScan samples(
        database_->query("SELECT scan, raw, value_C, quality, source_C FROM samples "
                         "WHERE test_id = ? AND scan BETWEEN ? AND ? ORDER BY scan, channel",
                         id, from_scan, to_scan));
    RowsByScan inputs(
        database_->query("SELECT scan, name, value FROM inputs "
                         "WHERE test_id = ? AND scan BETWEEN ? AND ? ORDER BY scan, name",
                         id, from_scan, to_scan));
    while (rows.next()) {
        ScanRecord scan;
        scan.scan = rows.integer(0);
        scan.status = scan_status_from_string(rows.text(1)).value_or(ScanStatus::missed);
        scan.time_s = rows.real(2);
        scan.scheduled_ns = rows.integer(3);
        scan.started_ns = rows.optional_integer(4);
        scan.finished_ns = rows.optional_integer(5);
        scan.wall_ns = rows.integer(6);
        samples.of(scan.scan, [&](const auto& row) { scan.samples.push_back(sample_in(row, 1)); });
        inputs.of(scan.scan, [&](const auto& row) { scan.inputs.push_back({row.text(1), row.real(2)}); });
        take(scan);
    }
    for (const auto& status : {rows.status(), samples.status(), inputs.status()})
        if (!status) return status;
    return {};
}

Result<RecordedTest> Reader::recorded_test(TestId id) const {
    sqlite::Transaction snapshot(*database_, sqlite::Transaction::Kind::read);
    if (!snapshot.begun()) return std::unexpected(snapshot.begun().error());
    auto test = this->test(id);
    if (!test) return std::unexpected(test.error());
    RecordedTest recorded;
    std::vector<std::int64_t> scan_of_row;
    auto rows = database_->query("SELECT scan, time_s FROM scans WHERE test_id = ? ORDER BY scan", id);
    while (rows.next()) {
        scan_of_row.push_back(rows.integer(0));
        recorded.time_s.push_back(rows.real(1));
    }
    if (auto status = rows.status(); !status) return std::unexpected(status.error());
    auto inputs = input_names(*database_, id, INT64_MAX);
    if (!inputs) return std::unexpected(inputs.error());
    recorded.channels = empty_columns(names_of(test->record.channels), recorded.time_s.size());
    recorded.inputs = empty_columns(*inputs, recorded.time_s.size());
    const auto row_of = [&](std::int64_t scan) -> std::optional<std::size_t> {
        const auto at = std::lower_bound(scan_of_row.begin(), scan_of_row.end(), scan);
        if (at == scan_of_row.end() || *at != scan) return std::nullopt;
        return static_cast<std::size_t>(at - scan_of_row.begin());
    };
    if (auto filled = fill_columns(*database_, id, INT64_MAX, row_of, recorded.channels, recorded.inputs);
        !filled)
        return std::unexpected(filled.error());
    return recorded;
}

Result<TestWindow> Reader::window(TestId id, std::int64_t until_scan) const {
    sqlite::Transaction snapshot(*database_, sqlite::Transaction::Kind::read);
    if (!snapshot.begun()) return std::unexpected(snapshot.begun().error());
    auto test = this->test(id);
    if (!test) return std::unexpected(test.error());
    const std::int64_t last = std::min(test->last_scan.value_or(-1), until_scan);
    if (last < -1 || last >= most_scans)
        return fail(NextStep::stop,
                    fmt::format("database {}: test {} has a scan number {}: damaged; run verify",
                                database_->path().string(), id, last));
    auto inputs = input_names(*database_, id, until_scan);
    if (!inputs) return std::unexpected(inputs.error());
    TestWindow window;
    window.period_s = test->record.period_s;
    window.scans = static_cast<std::size_t>(last + 1);
    window.channels = empty_columns(names_of(test->record.channels), window.scans);
    window.inputs = empty_columns(*inputs, window.scans);
    const auto row_of = [](std::int64_t scan) { return std::optional(static_cast<std::size_t>(scan)); };
    if (auto filled = fill_columns(*database_, id, last, row_of, window.channels, window.inputs); !filled)
        return std::unexpected(filled.error());
    for (auto& input : window.inputs) hold_last_value(input);
    return window;
}

Result<std::string> Reader::csv(TestId id) const {
    auto recorded = recorded_test(id);
    if (!recorded) return std::unexpected(recorded.error());
    return format_recorded_test(*recorded);
}

Result<std::vector<DeclarationRecord>> Reader::declarations(TestId id) const {
    std::vector<DeclarationRecord> declarations;
    auto rows = database_->query(
        fmt::format("SELECT {} FROM declarations d JOIN channels c ON c.test_id = d.test_id AND c.position = "
                    "d.channel WHERE d.test_id = ? ORDER BY d.channel, d.window_end_scan",
                    declaration_columns),
        id);
    while (rows.next()) declarations.push_back(declaration_in(rows));
    if (auto status = rows.status(); !status) return std::unexpected(status.error());
    return declarations;
}

Result<std::vector<IdentificationRecord>> Reader::latest_identifications(TestId id) const {
    std::vector<IdentificationRecord> identifications;
    auto rows = database_->query(
        "SELECT c.name, i.window_end_scan, i.wall_ns, i.verdict FROM channels c "
        "JOIN identifications i ON i.test_id = c.test_id AND i.channel = c.position "
        "WHERE c.test_id = ? AND i.window_end_scan = (SELECT max(window_end_scan) FROM identifications "
        "WHERE test_id = c.test_id AND channel = c.position) ORDER BY c.position",
        id);
    while (rows.next()) identifications.push_back(identification_in(rows));
    if (auto status = rows.status(); !status) return std::unexpected(status.error());
    return identifications;
}

Result<std::vector<IdentificationRecord>> Reader::identifications(TestId id, std::string_view channel) const {
    std::vector<IdentificationRecord> identifications;
    auto rows = database_->query(
        "SELECT c.name, i.window_end_scan, i.wall_ns, i.verdict FROM channels c "
        "JOIN identifications i ON i.test_id = c.test_id AND i.channel = c.position "
        "WHERE c.test_id = ? AND c.name = ? ORDER BY i.window_end_scan",
        id, channel);
    while (rows.next()) identifications.push_back(identification_in(rows));
    if (auto status = rows.status(); !status) return std::unexpected(status.error());
    return identifications;
}

Result<std::vector<EventRecord>> Reader::events(std::optional<TestId> id, std::int64_t after_id,
                                                std::int64_t limit) const {
    const std::string select = fmt::format("SELECT {} FROM events ", event_columns);
    auto rows = id ? database_->query(select + "WHERE test_id = ? AND id > ? ORDER BY id DESC LIMIT ?", *id,
                                      after_id, limit)
                   : database_->query(select + "WHERE id > ? ORDER BY id DESC LIMIT ?", after_id, limit);
    std::vector<EventRecord> events;
    while (rows.next()) events.push_back(event_in(rows));
    if (auto status = rows.status(); !status) return std::unexpected(status.error());
    std::reverse(events.begin(), events.end());
    return events;
}

Result<std::vector<ArchiveRecord>> Reader::archive(std::string_view machine, std::int64_t most) const {
    std::vector<ArchiveRecord> archive;
    auto rows = database_->query(
        "SELECT id, machine, test_id, created_wall_ns, spectrum FROM archive WHERE ?1 = '' OR machine = ?1 "
        "ORDER BY id DESC LIMIT ?2",
        machine, most);
    while (rows.next())
        archive.push_back(
            {rows.integer(0), rows.text(1), rows.optional_integer(2), rows.integer(3), rows.text(4)});
    if (auto status = rows.status(); !status) return std::unexpected(status.error());
    return archive;
}

Result<void> Reader::backup(const std::filesystem::path& copy) const {
    std::error_code error;
    if (std::filesystem::exists(copy, error))
        return fail(NextStep::refuse_input,
                    fmt::format("backup {}: is there already; name a new file", copy.string()));
    return database_->run("VACUUM INTO ?", copy.string());
}

}  // namespace thermbal
