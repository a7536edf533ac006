#include "acquisition/scan_thread.hpp"

#include <cstdint>
#include <initializer_list>

#include <sched.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace thermbal {
namespace {

bool take_real_time() {
    const sched_param priority{.sched_priority = 1};
    return sched_setscheduler(0, SCHED_FIFO | SCHED_RESET_ON_FORK, &priority) == 0;
}

void take_high_nice() {
    for (const int nice : {-10, -5}) {
        if (setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), nice) == 0) return;
    }
}

/// Linux 6.12 and later: a thread that asks for a short slice goes before one that runs with a longer one,
/// without any privilege. Earlier ones ignore it. glibc 2.36 has no wrapper.
void ask_for_a_short_slice() {
    struct Attributes {
        std::uint32_t size = sizeof(Attributes);
        std::uint32_t policy = SCHED_OTHER;
        std::uint64_t flags = 0;
        std::int32_t nice = 0;
        std::uint32_t priority = 0;
        std::uint64_t runtime_ns = 0;
        std::uint64_t deadline_ns = 0;
        std::uint64_t period_ns = 0;
    } attributes;
    constexpr std::uint64_t shortest_ns = 100'000;
    attributes.nice = getpriority(PRIO_PROCESS, static_cast<id_t>(gettid()));
    attributes.runtime_ns = shortest_ns;
    syscall(SYS_sched_setattr, 0, &attributes, 0);
}

}  // namespace

void put_scan_thread_first() {
    // The kernel wakes others up to 50 us late, to wake several at once.
    prctl(PR_SET_TIMERSLACK, 1UL);
    if (take_real_time()) return;
    take_high_nice();
    ask_for_a_short_slice();
}

}  // namespace thermbal
