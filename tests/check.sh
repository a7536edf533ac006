#!/usr/bin/env bash
# Checks beyond the tests: tests/check.sh style|tidy|asan|tsan|fuzz [SECONDS] ...
#   style  clang-format on every source
#   tidy   clang-tidy on every source (about 15 min on 2 cores)
#   asan   the C++ tests and the programs under AddressSanitizer and UndefinedBehaviorSanitizer
#   tsan   what has threads under ThreadSanitizer
#   fuzz   what reads bytes from outside under libFuzzer, AddressSanitizer and UndefinedBehaviorSanitizer, so many seconds
#          a target (10), two targets at a time
set -euo pipefail
cd "$(dirname "$0")/.."

sources() { git ls-files '*.cpp' '*.hpp'; }

build() {  # preset, targets...
    local preset=$1
    shift
    cmake --preset "$preset" > /dev/null
    cmake --build --preset "$preset" --target "$@"
}

while [ $# -gt 0 ]; do
    check=$1
    shift
    case $check in
        style) sources | xargs clang-format-19 --dry-run --Werror ;;
        tidy)
            cmake --preset release > /dev/null
            git ls-files '*.cpp' | xargs -P 2 -n 4 clang-tidy-19 -p build/release --quiet
            ;;
        asan)
            # The rooms that bytes from outside reach.
            build asan series_test config_test store_test store_kill_test service_test acquisition_test simulator_test
            for test in series config store store_kill service acquisition simulator; do
                build/asan/tests/${test}_test --gtest_brief=1
            done
            ;;
        tsan)
            build tsan acquisition_test compute_test
            for test in acquisition compute; do build/tsan/tests/${test}_test --gtest_brief=1; done
            ;;
        fuzz)
            seconds=10
            if [[ ${1:-} =~ ^[0-9]+$ ]]; then
                seconds=$1
                shift
            fi
            build fuzz fuzzers
            tests/fuzz/run.sh "$seconds"
            ;;
        *) echo "tests/check.sh: unknown check '$check'; there are style, tidy, asan, tsan, fuzz" >&2; exit 2 ;;
    esac
done
