#include "compute/threads.hpp"

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <memory>
#include <thread>
#include <vector>

#include <sched.h>
#include <sys/resource.h>
#include <unistd.h>

namespace thermbal {
namespace {

/// Takes up to `wanted` of what is idle.
std::size_t take(std::atomic<std::size_t>& idle, std::size_t wanted) {
    std::size_t there = idle;
    while (there > 0 && !idle.compare_exchange_weak(there, there - std::min(there, wanted))) {
    }
    return std::min(there, wanted);
}

}  // namespace

void put_this_thread_last() {
    setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), 10);
    const sched_param none{};
    sched_setscheduler(0, SCHED_BATCH, &none);
}

ParallelFor parallel_on_threads(int threads, bool low_priority) {
    const auto idle = std::make_shared<std::atomic<std::size_t>>(std::max(threads, 1) - 1);
    return [idle, low_priority](std::size_t count, const std::function<void(std::size_t)>& body) {
        std::atomic<std::size_t> next = 0;
        const auto work = [&] {
            if (low_priority) put_this_thread_last();
            for (std::size_t i = next++; i < count; i = next++) body(i);
        };
        std::vector<std::jthread> helpers;
        for (std::size_t taken = count > 1 ? take(*idle, count - 1) : 0; taken > 0; --taken) {
            helpers.emplace_back([&] {
                work();
                ++*idle;  // at once: a body that still runs elsewhere may have use for it
            });
        }
        work();
    };
}

}  // namespace thermbal
