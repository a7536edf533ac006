"""The directions between the rooms: core computes and does nothing else, nobody includes against the arrows."""
import os
import pathlib
import re
import sys

from outcome import conclude

SOURCE = pathlib.Path(os.environ["THERMBAL_SOURCE_DIR"])
INCLUDE = re.compile(r'^\s*#\s*include\s*[<"]([^>"]+)[>"]', re.M)

# What each room may include of the others, from the arrows of the house.
MAY = {
    "base": set(), "series": {"base"}, "filter": {"base", "series"}, "regression": {"base", "series"},
    "modes": {"base", "series"}, "declaration": {"base", "series", "filter", "regression", "modes"},
    "network": {"base", "series"}, "gap": {"base", "series", "network"},
    "modbus": {"base", "series"}, "serial": {"base"}, "replay": {"base", "series"},
    "simulator": {"base", "series", "replay"},
}
NOT_IN_CORE = {
    "a socket, a file or a system call": re.compile(
        r"#\s*include\s*<(sys/|unistd|fcntl|netinet|arpa|termios|poll|fstream|filesystem|cstdio|iostream)"),
    "SQLite, Modbus, serial or systemd": re.compile(r"#\s*include\s*<(sqlite3|modbus|libserialport|systemd)"),
    "threads or locks": re.compile(r"#\s*include\s*<(thread|mutex|shared_mutex|condition_variable|future|atomic)>"),
    "a clock": re.compile(r"\b(steady_clock|system_clock|high_resolution_clock|clock_gettime|gettimeofday|time\(nullptr\))"),
    "logging or printing": re.compile(r"spdlog|std::cout|std::cerr|\bprintf\("),
    "randomness that is not an argument": re.compile(r"random_device|\brand\("),
}


def main():
    wrong = []
    rooms = {path.name: path for parent in ("core", "drivers") for path in (SOURCE / parent).iterdir() if path.is_dir()}
    seen = 0
    for room, folder in sorted(rooms.items()):
        for path in sorted([*folder.rglob("*.hpp"), *folder.rglob("*.cpp")]):
            seen += 1
            text = path.read_text(encoding="utf-8")
            where = path.relative_to(SOURCE)
            for included in INCLUDE.findall(text):
                other = included.split("/")[0]
                if other in rooms and other != room and room in MAY and other not in MAY[room]:
                    wrong.append(f"{where}: includes {included}, {room} may only know {sorted(MAY[room]) or 'itself'}")
            if folder.parent.name == "core":
                for what, pattern in NOT_IN_CORE.items():
                    if pattern.search(text):
                        wrong.append(f"{where}: {what} has no place in core")
    return conclude(wrong, seen, 30, "sources keep to the directions")


if __name__ == "__main__":
    sys.exit(main())
