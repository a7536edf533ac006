#pragma once

#include <cstddef>
#include <functional>

namespace thermbal {

/// Calls `body(i)` once for every i in [0, count), in any order, possibly on several threads, and returns
/// when all are done. core has no threads of its own: whoever calls it says how work is spread. `body` must
/// not throw.
using ParallelFor = std::function<void(std::size_t count, const std::function<void(std::size_t)>& body)>;

/// Asked between the parts of a long computation; true makes it return an Error soon. Must be safe to call
/// from ParallelFor's threads.
using Cancelled = std::function<bool()>;
inline bool never_cancelled() {
    return false;
}

/// Runs the bodies one after the other on the calling thread.
inline void sequential_for(std::size_t count, const std::function<void(std::size_t)>& body) {
    for (std::size_t i = 0; i < count; ++i) body(i);
}

}  // namespace thermbal
