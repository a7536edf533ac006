#!/usr/bin/env bash
# Builds everything and runs every test: tests/run.sh [ctest arguments]
set -euo pipefail
cd "$(dirname "$0")/.."
.ci/install build demo tests
cmake --preset release > /dev/null
cmake --build --preset release
ctest --preset release --parallel 2 --timeout 900 "$@"
