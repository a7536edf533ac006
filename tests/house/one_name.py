"""One name, one type: the namespace is flat, and two rooms in one program that call different types the same share their
destructors without a word from the linker."""
import os
import pathlib
import re
import sys

from outcome import conclude

SOURCE = pathlib.Path(os.environ["THERMBAL_SOURCE_DIR"])
TYPE = re.compile(r"^(?:struct|class|enum class) (\w+)(?: final)?(?: : [^{;]+)? \{", re.M)
# Rooms that no program has together.
NEVER_TOGETHER = [("daemon/client", "daemon/thermbald"), ("daemon/publish", "drivers/simulator")]
# Plain numbers, for which no code is generated.
HARMLESS = {"Request"}


def room_of(path):
    return "/".join(path.relative_to(SOURCE).parts[:2])


def main():
    rooms_of = {}
    for parent in ("core", "drivers", "config", "daemon"):
        for path in (SOURCE / parent).rglob("*.hpp"):
            for name in TYPE.findall(path.read_text(encoding="utf-8")):
                rooms_of.setdefault(name, set()).add(room_of(path))
    wrong = [f"{name}: in {' and '.join(sorted(rooms))}" for name, rooms in sorted(rooms_of.items())
             if len(rooms) > 1 and name not in HARMLESS and tuple(sorted(rooms)) not in NEVER_TOGETHER]
    return conclude(wrong, len(rooms_of), 200, "types, each with a name of its own")


if __name__ == "__main__":
    sys.exit(main())
