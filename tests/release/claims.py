#!/usr/bin/python3
"""Every claim of systemd/SECURITY.md of what cannot be done names a test, and every test that it names is there.

    THERMBAL_SOURCE_DIR=. tests/release/claims.py
"""
import os
import pathlib
import re
import sys

SOURCE = pathlib.Path(os.environ["THERMBAL_SOURCE_DIR"])
TESTS = [path for path in (SOURCE / "tests").rglob("*") if path.suffix in (".cpp", ".py", ".sh", ".txt")
         and path != pathlib.Path(__file__).resolve()]


def claims():
    """(claim, names of tests) of the tables of what an attacker can and cannot do."""
    for line in (SOURCE / "systemd" / "SECURITY.md").read_text(encoding="utf-8").splitlines():
        cells = [cell.strip() for cell in line.strip("|").split(" | ")]
        if len(cells) == 3 and re.match(r"can\b|cannot\b|is hindered", cells[0]):
            yield f"{cells[0]} {cells[1]}", re.findall(r"`([^`]+)`", cells[2])


def names_in_sources():
    """The tests of GoogleTest as Suite.Name, and every word of the tests' sources."""
    text = "\n".join(path.read_text(encoding="utf-8") for path in TESTS)
    suites = {f"{suite}.{name}" for suite, name in re.findall(r"TEST(?:_F|_P)?\((\w+),\s*(\w+)\)", text)}
    return suites, set(re.findall(r"\w+", text))


def is_there(name, suite, suites, words):
    if name.startswith("tests/"):
        return (SOURCE / name.split()[0]).exists()
    if name.endswith("*"):
        return any(test.startswith(name.rstrip("*").rstrip(".")) for test in suites)
    if "." in name:
        return (suite + name if name.startswith(".") else name) in suites
    return name in words


def main():
    suites, words = names_in_sources()
    found, wrong = 0, []
    for claim, names in claims():
        found += 1
        suite = ""
        if not names and claim.startswith(("cannot", "is hindered")):
            wrong.append(f"{claim}: no test")
        for name in names:
            suite = name.split(".")[0] or suite
            if not is_there(name, suite, suites, words):
                wrong.append(f"{claim}: no test is named {name}")
    assert found >= 15, "the tables have another form"
    print(*wrong, f"{found} claims", sep="\n")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
