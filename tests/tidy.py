#!/usr/bin/python3
"""clang-tidy on every source, on those of some rooms, or on what a change touches; two at a time.

    tests/tidy.py [ROOM ...] [--changed-since COMMIT] [--build build/tidy-UnifiedSource]

The preset tidy compiles sources by the dozen, so that their headers are judged once. The static analyzer looks into a source that
another one includes only where the including one's path has the word UnifiedSource in it: hence the folder's name.

What passed is not judged again while nothing it depends on has changed: what counts is its whole text after
preprocessing (comments kept: NOLINT is one), its compile command, .clang-tidy and the version of clang-tidy. It is
remembered in $XDG_CACHE_HOME/thermbal-tidy (~/.cache). With --changed-since: the sources that changed since, those that
include a header that did, and those compiled with them.
"""
import argparse
import concurrent.futures
import hashlib
import json
import os
import pathlib
import re
import shlex
import subprocess
import sys

TIDY, CLANG = "clang-tidy-19", "clang++-19"
PASSED = pathlib.Path(os.environ.get("XDG_CACHE_HOME", pathlib.Path.home() / ".cache")) / "thermbal-tidy"


def output_of(*command, **options):
    return subprocess.run(command, capture_output=True, text=True, check=True, **options).stdout


def dependencies(entry, flags, *how):
    return subprocess.run([CLANG, *flags, *how, entry["file"]], cwd=entry["directory"], capture_output=True, check=False).stdout


def flags_of(entry):
    """The compile command without compiler, launcher, input and output; without what only gcc knows."""
    words = shlex.split(entry["command"])
    words = words[next(i for i, word in enumerate(words) if word.startswith("-")):]
    kept, skip = [], False
    for word in words:
        if skip or word in ("-o", "-c", entry["file"]) or word.startswith("-fprofile"):
            skip = word == "-o"
            continue
        kept.append(word)
    return [*kept, "-w"]


def key_of(entry, settings):
    text = entry["command"].encode() + dependencies(entry, flags_of(entry), "-E", "-C")
    return hashlib.sha256(settings + text.replace(os.fsencode(os.getcwd()), b"")).hexdigest()


def sources_of(entry):
    """The sources that are compiled by it: itself, or those it includes."""
    included = re.findall(r'^#include "(/.*\.cpp)"$', pathlib.Path(entry["file"]).read_text(encoding="utf-8"), re.MULTILINE)
    return included or [entry["file"]]


def judged(entry, settings, build):
    """(file, what clang-tidy says; empty: passed)"""
    passed = PASSED / key_of(entry, settings)
    if passed.exists():
        return entry["file"], "", True
    done = subprocess.run([TIDY, "-p", build, "--quiet", "--checks=-bugprone-suspicious-include", entry["file"]],
                          capture_output=True, text=True, check=False)
    if done.returncode == 0 and "warning:" not in done.stdout:
        passed.touch()
        return entry["file"], "", False
    return entry["file"], done.stdout + done.stderr[-2000:] * (done.returncode != 0), False


def touched(entries, commit):
    changed = {str(pathlib.Path(name).resolve()) for name in
               output_of("git", "diff", "--name-only", "--diff-filter=d", commit, "--", "*.cpp", "*.hpp").split()}
    for entry in entries:
        if changed.intersection(sources_of(entry)):
            yield entry
        elif any(name.endswith(".hpp") for name in changed):
            listed = dependencies(entry, flags_of(entry), "-MM").decode()
            used = {os.path.realpath(os.path.join(entry["directory"], name)) for name in re.findall(r"\S+\.hpp", listed)}
            if used & changed:
                yield entry


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("rooms", nargs="*", metavar="ROOM")
    parser.add_argument("--changed-since", metavar="COMMIT")
    parser.add_argument("--build", default="build/tidy-UnifiedSource")
    arguments = parser.parse_args()
    tracked = {str(pathlib.Path(name).resolve()) for name in output_of("git", "ls-files", "*.cpp").split()}
    database = json.loads((pathlib.Path(arguments.build) / "compile_commands.json").read_text(encoding="utf-8"))
    entries = list({entry["file"]: entry for entry in database if tracked.intersection(sources_of(entry))}.values())
    if arguments.rooms:
        rooms = [pathlib.Path(room).resolve() for room in arguments.rooms]
        entries = [entry for entry in entries
                   if any(pathlib.Path(source).is_relative_to(room) for source in sources_of(entry) for room in rooms)]
    if arguments.changed_since:
        entries = list(touched(entries, arguments.changed_since))
    PASSED.mkdir(parents=True, exist_ok=True)
    settings = pathlib.Path(".clang-tidy").read_bytes() + output_of(TIDY, "--version").encode()
    bad = known = 0
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        for file, said, remembered in pool.map(lambda entry: judged(entry, settings, arguments.build), entries):
            known += remembered
            if said:
                bad += 1
                print(f"{file}:\n{said}", flush=True)
    sources = sum(len(sources_of(entry)) for entry in entries)
    print(f"clang-tidy: {sources} sources compiled as {len(entries)}, {known} of these as they were when they passed, {bad} not clean")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
