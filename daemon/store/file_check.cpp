#include "store/file_check.hpp"

#include <utility>

#include <sys/resource.h>
#include <unistd.h>

#include "store/reader.hpp"

namespace thermbal {
namespace {

void check(const std::stop_token& stop, const std::filesystem::path& database,
           const std::function<void(Result<bool>)>& done) {
    setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), 10);
    const auto reader = Reader::open(database);
    if (!reader) {
        // What cannot even be opened because of what is in it is damaged.
        const bool damaged = reader.error().next == NextStep::stop;
        return done(damaged ? Result<bool>(false) : std::unexpected(reader.error()));
    }
    auto sound = reader->is_sound(stop);
    if (!stop.stop_requested()) done(std::move(sound));
}

}  // namespace

FileCheck::FileCheck(std::filesystem::path database, std::function<void(Result<bool>)> done)
    : thread_([database = std::move(database), done = std::move(done)](const std::stop_token& stop) {
          check(stop, database, done);
      }) {}

}  // namespace thermbal
