// How long one acknowledged scan of 16 channels takes on a folder's disk.
#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <vector>

#include <fmt/format.h>

#include "store/store.hpp"

int main(int argc, char** argv) {
    using namespace thermbal;
    using Clock = std::chrono::steady_clock;
    if (argc < 2) {
        fmt::print(stderr, "usage: store_commit_time FOLDER [SCANS]\n");
        return 2;
    }
    const auto path = std::filesystem::path(argv[1]) / "commit_time.db";
    const auto count = argc > 2 ? std::strtoll(argv[2], nullptr, 10) : 2000;
    auto store = Store::open(path, {});
    if (!store) {
        fmt::print(stderr, "{}\n", store.error().message);
        return 1;
    }
    TestRecord test;
    for (int i = 1; i <= 16; ++i) {
        test.channels.emplace_back();
        test.channels.back().name = fmt::format("T{}", i);
    }
    const auto id = store->begin_test(test);
    if (!id) {
        fmt::print(stderr, "{}\n", id.error().message);
        return 1;
    }
    std::vector<double> commit_ms;
    std::vector<double> checkpoint_ms;
    const auto since = [](Clock::time_point from) {
        return std::chrono::duration<double, std::milli>(Clock::now() - from).count();
    };
    for (std::int64_t k = 0; k < count; ++k) {
        ScanRecord scan;
        scan.scan = k;
        scan.time_s = 15.0 * static_cast<double>(k);
        scan.samples.assign(16, {200U, 20.0 + 0.01 * static_cast<double>(k), Quality::good});
        const auto before = Clock::now();
        if (auto done = store->append_scan(*id, scan); !done) {
            fmt::print(stderr, "{}\n", done.error().message);
            return 1;
        }
        commit_ms.push_back(since(before));
        const auto between = Clock::now();
        (void)store->checkpoint();
        checkpoint_ms.push_back(since(between));
    }
    const auto report = [](const char* what, std::vector<double>& times) {
        std::sort(times.begin(), times.end());
        const auto at = [&](double share) {
            return times[static_cast<std::size_t>(share * double(times.size() - 1))];
        };
        fmt::print("{} ms: p50 {:.3f}  p99 {:.3f}  max {:.3f}\n", what, at(0.5), at(0.99), times.back());
    };
    report("commit    ", commit_ms);
    report("checkpoint", checkpoint_ms);
    const auto before = Clock::now();
    const auto window = store->read().window(*id);
    fmt::print("window of {} scans ms: {:.3f}; database {} bytes, log {} bytes\n", window ? window->scans : 0,
               since(before), store->database_bytes(), store->wal_bytes());
    (void)store->set_state(*id, TestState::stopped, {}, "done");
    return 0;
}
