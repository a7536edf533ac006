#include "compute/identifier.hpp"

#include <chrono>
#include <utility>

namespace thermbal {
namespace {

/// What is identified, and how long it took.
auto timed(Identifier::Identify identify) {
    return [identify = std::move(identify)](const IdentificationJob& job,
                                            const std::function<bool()>& cancelled) {
        const auto started = std::chrono::steady_clock::now();
        auto verdict = identify(job, cancelled);
        const std::chrono::duration<double> took = std::chrono::steady_clock::now() - started;
        return IdentificationResult{job.generation, job.window_end_scan, took.count(), std::move(verdict)};
    };
}

}  // namespace

Identifier::Identifier(Identify identify, std::function<void(IdentificationResult)> done)
    : NewestFirst(timed(std::move(identify)), std::move(done)) {}

}  // namespace thermbal
