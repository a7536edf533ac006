#!/usr/bin/python3
"""What the linker and the compiler were told, read back from the programs: a position-independent executable, every
relocation read-only after the start, no executable stack, no search path of the builder, stack protector, FORTIFY, control-flow
protection; and no installed file that runs as its owner. Prints a line a program.

    THERMBAL_BIN_DIR=build/release/bin tests/release/hardening.py [PROGRAM ...]
"""
import os
import pathlib
import platform
import re
import stat
import subprocess
import sys
import tempfile

BIN = pathlib.Path(os.environ["THERMBAL_BIN_DIR"])


def readelf(program, *flags):
    return subprocess.run(["readelf", "--wide", *flags, program], capture_output=True, text=True, check=True).stdout


def landing_pads(program):
    """How many functions begin with one. The C runtime's own start-up code has four or so in any program."""
    listing = subprocess.run(["objdump", "-d", "--section=.text", program], capture_output=True, text=True, check=True).stdout
    return listing.count("endbr64")


def findings(program):
    """What a hardened program has, by name."""
    header, segments = readelf(program, "-h"), readelf(program, "-l")
    dynamic, symbols, notes = readelf(program, "-d"), readelf(program, "--dyn-syms"), readelf(program, "-n")
    stack = re.search(r"GNU_STACK(?:\s+0x[0-9a-f]+)+\s+(R?W?E?)\s", segments)
    checked = set(re.findall(r"\b__(\w+)_chk\b", symbols))
    found = {
        "pie": "DYN (Position-Independent Executable file)" in header and "PIE" in dynamic,
        "relro": "GNU_RELRO" in segments,
        "bind now": "BIND_NOW" in dynamic or re.search(r"FLAGS_1.*\bNOW\b", dynamic) is not None,
        "stack not executable": stack is not None and "E" not in stack.group(1),
        "no text relocations": "TEXTREL" not in dynamic,
        "no RPATH": "RPATH" not in dynamic and "RUNPATH" not in dynamic,
        "stack protector": "__stack_chk_fail" in symbols,
        "FORTIFY": bool(checked - {"stack", "longjmp"}),
        "no writable and executable segment": re.search(r"LOAD.*\bRWE\b", segments) is None,
    }
    # Landing pads. The mark that lets a kernel insist on them is the linker's to give, and Debian 12's C runtime (crt1.o)
    # lacks it, so that no program there has it.
    if platform.machine() in ("x86_64", "AMD64"):
        found["control-flow protection"] = landing_pads(program) > 100
    return found


def is_sanitized(program):
    return re.search(r"__(asan|tsan|ubsan)_", readelf(program, "--dyn-syms")) is not None


def set_id_files():
    """Of what `cmake --install` puts down."""
    with tempfile.TemporaryDirectory(prefix="thermbal-") as folder:
        subprocess.run(["cmake", "--install", str(BIN.parent), "--prefix", "/usr"], check=True, capture_output=True,
                       env={**os.environ, "DESTDIR": folder})
        files = [path for path in pathlib.Path(folder).rglob("*") if path.is_file()]
        assert any(path.name == "thermbald" for path in files), "nothing was installed"
        return [str(path) for path in files if path.stat().st_mode & (stat.S_ISUID | stat.S_ISGID)]


def main():
    programs = [pathlib.Path(name) for name in sys.argv[1:]] or sorted(
        path for path in BIN.iterdir() if path.name.startswith("thermbal") and os.access(path, os.X_OK))
    assert programs, f"no program in {BIN}"
    if any(is_sanitized(program) for program in programs):
        print("skipped: a build for sanitizers is not hardened")
        return 77
    failed = False
    for program in programs:
        missing = [name for name, there in findings(program).items() if not there]
        print(f"{program.name}: {'lacks ' + ', '.join(missing) if missing else 'all of it'}")
        failed |= bool(missing)
    if not sys.argv[1:]:
        privileged = set_id_files()
        print(f"set-user-id or set-group-id files: {privileged or 'none'}")
        failed |= bool(privileged)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
