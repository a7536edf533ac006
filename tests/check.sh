#!/usr/bin/env bash
# Checks beyond the tests: tests/check.sh CHECK ...
#   style        clang-format on every source
#   tidy         clang-tidy on every source (about 40 min of processor, estimated; what passed once is remembered)
#   tidy-changed clang-tidy on what differs from the commit before, or from $THERMBAL_BASE
#   clang        the programs by clang
#   asan         the C++ tests of what bytes from outside reach, under AddressSanitizer and UndefinedBehaviorSanitizer
#   tsan         what has threads under ThreadSanitizer
#   fuzz [SECONDS]  what reads bytes from outside under libFuzzer and the sanitizers, so many seconds a target (10), two at a time
#   coverage     the lines that all C++ tests cover
#   packages     the Debian packages: lintian, and as root everything in a clean Debian root
#   nightly      all that is too long for every change: tidy, clang with its tests, coverage, fuzz for 10 min a target, packages,
#                a reproducible build, clients against scans, and a soak of some days
set -euo pipefail
cd "$(dirname "$0")/.."

sources() { git ls-files '*.cpp' '*.hpp'; }

build() {  # preset, targets...
    local preset=$1
    shift
    cmake --preset "$preset" > /dev/null
    cmake --build --preset "$preset" --target "$@"
}

covered() {  # preset, rooms... : the share of their lines and branches that has run
    local build=build/$1 filters=()
    shift
    for room in "$@"; do filters+=(--filter "$room/"); done
    gcovr --root . "${filters[@]}" --gcov-ignore-parse-errors --exclude-throw-branches "$build" | tail -n +5
}

while [ $# -gt 0 ]; do
    check=$1
    shift
    case $check in
        style) sources | xargs clang-format-19 --dry-run --Werror ;;
        tidy)
            cmake --preset tidy > /dev/null
            tests/tidy.py
            ;;
        tidy-changed)
            cmake --preset tidy > /dev/null
            tests/tidy.py --changed-since "${THERMBAL_BASE:-HEAD~1}"
            ;;
        clang) build clang thermbald thermbalctl thermbal-sim ;;
        asan)
            # The rooms that bytes from outside reach, in the build of the fuzz targets: it has both sanitizers.
            tests=(series config store store_kill service acquisition simulator)
            build fuzz "${tests[@]/%/_test}"
            printf '%s\n' "${tests[@]}" | xargs -P 2 -I{} env build/fuzz/tests/{}_test --gtest_brief=1
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
        coverage)
            cmake --preset coverage > /dev/null
            cmake --build --preset coverage
            ctest --test-dir build/coverage --parallel 2 --timeout 900 --output-on-failure
            covered coverage core config drivers daemon
            ;;
        packages)
            tests/release/packages.sh build lintian
            if [ "$(id -u)" = 0 ]; then tests/release/packages.sh installed; fi
            ;;
        nightly)
            "$0" style tidy coverage
            cmake --preset clang > /dev/null
            cmake --build --preset clang
            ctest --preset clang --parallel 2 --timeout 900 --repeat until-pass:3
            "$0" asan tsan fuzz 600 packages
            tests/release/reproducible.sh
            THERMBAL_BIN_DIR=build/release/bin THERMBAL_SOURCE_DIR=. tests/release/hostile.py
            THERMBAL_BIN_DIR=build/release/bin THERMBAL_SOURCE_DIR=. tests/faults/month.py --days 3
            ;;
        *) echo "tests/check.sh: unknown check '$check'; there are style, tidy, tidy-changed, clang, asan, tsan, fuzz, coverage, packages, nightly" >&2; exit 2 ;;
    esac
done
