#include "compute/threads.hpp"

#include <algorithm>
#include <atomic>
#include <thread>
#include <vector>

#include <sched.h>
#include <sys/resource.h>
#include <unistd.h>

namespace thermbal {

void put_this_thread_last() {
    setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), 10);
    const sched_param none{};
    sched_setscheduler(0, SCHED_BATCH, &none);
}

ParallelFor parallel_on_threads(int threads, bool low_priority) {
    return [threads, low_priority](std::size_t count, const std::function<void(std::size_t)>& body) {
        std::atomic<std::size_t> next = 0;
        const auto work = [&] {
            if (low_priority) put_this_thread_last();
            for (std::size_t i = next++; i < count; i = next++) body(i);
        };
        std::vector<std::jthread> helpers;
        const std::size_t wanted = std::min(count, static_cast<std::size_t>(std::max(threads, 1)));
        for (std::size_t i = 0; i < wanted; ++i) helpers.emplace_back(work);
    };
}

}  // namespace thermbal
