#!/usr/bin/env bash
# The same packages from the same sources: two copies of the committed sources in folders of different names, built without a
# compiler cache at different times, must give the same bytes.
#   tests/release/reproducible.sh            everything: two whole builds
#   tests/release/reproducible.sh TARGET     only this program, unpacked: quicker
set -euo pipefail
cd "$(dirname "$0")/../.."
work=$(mktemp -d -t thermbal-twice-XXXXXX)
trap 'rm -rf "$work"' EXIT
SOURCE_DATE_EPOCH=$(dpkg-parsechangelog -l .packaging/debian/changelog -S Timestamp)
export SOURCE_DATE_EPOCH CCACHE_DISABLE=1
commit=$(git rev-parse HEAD)
for folder in "$work/a" "$work/another/name"; do
    mkdir -p "$folder"
    git archive "$commit" | tar -x -C "$folder"
    (
        cd "$folder"
        cmake --preset package > /dev/null
        if (($#)); then
            cmake --build --preset package --target "$1" > /dev/null
        else
            cmake --build --preset package > /dev/null
            (cd build/package && cpack > /dev/null)
        fi
    )
done
cd "$work/a/build/package"
if (($#)); then
    found=("bin/$1")
else
    found=(*.deb *.ddeb)
fi
for file in "${found[@]}"; do
    cmp "$file" "$work/another/name/build/package/$file"
    echo "the same twice: $file $(sha256sum "$file" | cut -c1-16)"
done
