"""The table of bad input in daemon/thermbald/README.md, row by row: what the documentation says is what the programs say."""
import os
import shlex
import subprocess

from daemon_support import BIN, SOURCE, run

FOLDER = "daemon/thermbald/README.md"


def rows():
    text = (SOURCE / FOLDER).read_text(encoding="utf-8")
    table = text.split("## Bad input", 1)[1]
    for line in table.splitlines():
        cells = [cell.strip() for cell in line.strip().strip("|").split("|")]
        if line.startswith("|") and len(cells) == 4 and cells[1].startswith("`"):
            yield cells[0], cells[1].strip("`"), cells[2], [int(status) for status in cells[3].split(" or ")]


def every_row_of_the_table():
    environment = {**os.environ, "PATH": f"{BIN.resolve()}:{os.environ['PATH']}"}
    wrong = []
    count = 0
    for what, command, says, statuses in rows():
        count += 1
        done = subprocess.run(shlex.split(command), cwd=SOURCE, env=environment, capture_output=True, text=True, timeout=10,
                              stdin=subprocess.DEVNULL)
        if says not in done.stderr or done.returncode not in statuses:
            wrong.append(f"{what}: {command}: status {done.returncode}, wanted {statuses}\n  says  {done.stderr.strip()}\n"
                         f"  wanted {says}")
        if done.stdout:
            wrong.append(f"{what}: something on standard output: {done.stdout[:200]}")
    assert not wrong, "\n".join(wrong)
    assert count >= 20, count


if __name__ == "__main__":
    run([every_row_of_the_table])
