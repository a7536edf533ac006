#!/usr/bin/env bash
# What CI runs, on a machine that has nothing: tests/release/fresh.sh [COMMAND ...]   (.ci/run; as root; 20 min and 3 GB)
# A clone of the last commit in a Debian 12 of its own (debootstrap's minbase, git, certificates), with this host's kernel,
# network and apt sources. A package that only happens to be on the developer's machine is missing here.
set -euo pipefail
cd "$(dirname "$0")/../.."
(($#)) || set -- .ci/run
((EUID == 0)) || { echo "tests/release/fresh.sh: needs root: it makes a Debian root" >&2; exit 2; }
command -v debootstrap > /dev/null || { echo "tests/release/fresh.sh: needs debootstrap: apt-get install debootstrap" >&2; exit 2; }

root=$(mktemp -d "${TMPDIR:-/tmp}/thermbal-fresh-XXXXXX")
mounted=()
clean_up() {
    for ((i = ${#mounted[@]} - 1; i >= 0; --i)); do umount --lazy "${mounted[i]}"; done
    rm -rf --one-file-system "$root"
}
trap clean_up EXIT
chmod 755 "$root"
mirror=$(apt-get indextargets --format '$(REPO_URI) $(CODENAME)' 'Created-By: Packages' | grep -m1 ' bookworm$' | cut -d' ' -f1)
debootstrap --variant=minbase --include=ca-certificates,git bookworm "$root" "$mirror" > /dev/null
cp /etc/resolv.conf /etc/hosts "$root/etc/"
cp -r /etc/apt/. "$root/etc/apt/"
# What apt's configuration on this host calls is not there.
for setting in "$root"/etc/apt/apt.conf.d/*; do grep -qE 'Invoke|Periodic' "$setting" && rm "$setting"; done
for place in proc sys dev; do
    mount --rbind "/$place" "$root/$place"
    mount --make-rslave "$root/$place"  # what is unmounted here stays mounted on the host
    mounted+=("$root/$place")
done
git clone --quiet . "$root/thermbal"
chroot "$root" env -i HOME=/root PATH=/usr/sbin:/usr/bin:/sbin:/bin LANG=C.UTF-8 sh -c 'cd /thermbal && exec "$@"' sh "$@"
