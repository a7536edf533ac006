#include "abort_test.hpp"

#include <fmt/format.h>

#include "store/store.hpp"

namespace thermbal {

Result<std::string> abort_open_test(const std::filesystem::path& database, Moment now) {
    constexpr const char* reason = "ended by hand while no daemon ran (--abort-test)";
    auto store = Store::open(database, now);
    if (!store) return std::unexpected(store.error());
    const auto open = store->read().open_test();
    if (!open) return std::unexpected(open.error());
    if (!*open) return fmt::format("{}: no test is open", database.string());
    const TestId id = (*open)->id;
    if (auto ended = store->set_state(id, TestState::aborted, now, reason); !ended)
        return std::unexpected(ended.error());
    const EventRecord event{.id = 0,
                            .test_id = id,
                            .wall_ns = now.wall_ns,
                            .time_s = {},
                            .kind = "aborted",
                            .channel = {},
                            .message = reason};
    if (auto told = store->record_event(event); !told) return std::unexpected(told.error());
    return fmt::format("test {} \"{}\" is aborted", id, (*open)->record.name);
}

}  // namespace thermbal
