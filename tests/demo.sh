#!/usr/bin/env bash
# The main job without a machine: a simulated 16-channel module on real Modbus, the daemon, faster than time, to the
# declaration. tests/demo.sh [--rtu] [--condition 5000-idle|3000-idle|3000-cutting] [--keep FOLDER]
set -euo pipefail
cd "$(dirname "$0")/.."
.ci/install build demo
cmake --preset release -DTHERMBAL_TESTS=OFF -B build/demo > /dev/null
cmake --build build/demo --target thermbald thermbalctl thermbal-sim
# Configuration, database, recording and report stay where the last line says.
case " $* " in *" --keep "*) ;; *) rm -rf build/demo/test && set -- "$@" --keep build/demo/test ;; esac
exec build/demo/bin/thermbalctl demo "$@"
