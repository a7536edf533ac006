#include "compute/threads.hpp"

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <memory>
#include <system_error>
#include <thread>
#include <vector>

#include <sched.h>
#include <sys/resource.h>
#include <unistd.h>

namespace thermbal {
namespace {

/// Takes up to `wanted` of what is idle.
int take(std::atomic<int>& idle, int wanted) {
    int there = idle;
    while (there > 0 && !idle.compare_exchange_weak(there, there - std::min(there, wanted))) {
    }
    return std::clamp(there, 0, wanted);
}

/// Whether this thread runs a body.
struct InsideACall {
    InsideACall() { ++depth; }
    ~InsideACall() { --depth; }
    InsideACall(const InsideACall&) = delete;
    InsideACall& operator=(const InsideACall&) = delete;
    static thread_local int depth;
};
thread_local int InsideACall::depth = 0;

}  // namespace

void put_this_thread_last() {
    setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), 10);
    const sched_param none{};
    sched_setscheduler(0, SCHED_BATCH, &none);
}

ParallelFor parallel_on_threads(int threads, bool low_priority) {
    const std::size_t most = static_cast<std::size_t>(std::max(threads, 1));
    const auto idle = std::make_shared<std::atomic<int>>(static_cast<int>(most) - 1);
    return [most, idle, low_priority](std::size_t count, const std::function<void(std::size_t)>& body) {
        std::atomic<std::size_t> next = 0;
        const auto work = [&] {
            if (low_priority) put_this_thread_last();
            const InsideACall inside;
            for (std::size_t i = next++; i < count; i = next++) body(i);
        };
        std::vector<std::jthread> helpers;
        const int others = static_cast<int>(std::clamp(count, std::size_t{1}, most)) - 1;
        helpers.reserve(static_cast<std::size_t>(others));
        for (int taken = take(*idle, others); taken > 0; --taken) {
            try {
                // Who has nothing left to begin is idle at once: a body that still runs may have use for a
                // thread.
                helpers.emplace_back([&] {
                    work();
                    ++*idle;
                });
            } catch (const std::system_error&) {
                // The system has no thread left: those there are do all of it.
                *idle += taken;
                break;
            }
        }
        work();
        // Inside a body the thread has more to do after this call, and stays taken.
        if (InsideACall::depth > 0) return;
        ++*idle;
        helpers.clear();
        --*idle;
    };
}

}  // namespace thermbal
