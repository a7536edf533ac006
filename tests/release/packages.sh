#!/usr/bin/env bash
# The Debian packages, made and judged: tests/release/packages.sh [build|lintian|installed] ... (all three without a word).
#   build      build/package/*.deb, with the newest changelog entry's time
#   lintian    no error and no warning
#   installed  install, measure in the sandbox, instance, upgrade with a running test, remove, purge, in a clean Debian root
#              that systemd-nspawn boots (as root; about 2 min and 300 MB, most of it the root: THERMBAL_CLEAN_ROOT=FOLDER keeps it)
set -euo pipefail
cd "$(dirname "$0")/../.."
(($#)) || set -- build lintian installed
SOURCE_DATE_EPOCH=${SOURCE_DATE_EPOCH:-$(dpkg-parsechangelog -l .packaging/debian/changelog -S Timestamp)}
export SOURCE_DATE_EPOCH
for step in "$@"; do
    case $step in
        build)
            cmake --preset package > /dev/null
            cmake --build --preset package
            rm -f build/package/*.deb build/package/*.ddeb
            (cd build/package && cpack)
            ;;
        lintian) lintian --allow-root --fail-on error,warning build/package/*.deb ;;
        installed) PYTHONDONTWRITEBYTECODE=1 python3 tests/release/installed.py build/package ;;
        *) echo "tests/release/packages.sh: unknown step '$step'; there are build, lintian, installed" >&2; exit 2 ;;
    esac
done
