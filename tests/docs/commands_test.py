"""Runs what the documentation tells a person to type: every line that begins with `$ ` in a console block, page by page, each
page in an empty folder with the programs on the path. And: every file and page that the documentation names is there."""
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import time

BIN = pathlib.Path(os.environ["THERMBAL_BIN_DIR"])
SOURCE = pathlib.Path(os.environ["THERMBAL_SOURCE_DIR"])
DOCS = SOURCE / "config/docs"


def commands_of(page):
    for block in re.findall(r"```console\n(.*?)```", page.read_text(encoding="utf-8"), re.S):
        for line in block.splitlines():
            assert line.startswith("$ "), (page.name, line)
            yield line[2:]


class Shell:
    """One demonstration serves every page: a page that asks for it again gets a copy of its folder."""

    def __init__(self, made):
        self.made = made

    def run(self, command, folder):
        kept = re.fullmatch(r"thermbalctl demo --keep (\w+)", command)
        if kept and self.made:
            shutil.copytree(self.made, folder / kept.group(1))
            return
        if command == "thermbalctl demo" and self.made:
            return
        done = subprocess.run(["bash", "-euo", "pipefail", "-c", command], cwd=folder, capture_output=True, text=True, timeout=600,
                              env={**os.environ, "PATH": f"{BIN}:{os.environ['PATH']}"})
        assert done.returncode == 0, (command, done.returncode, done.stdout, done.stderr)
        assert done.stdout or done.stderr or re.search(r">| --(csv|out) ", command), (command, "says nothing")
        if kept:
            self.made = folder / kept.group(1)


def commands_work(scratch):
    shell = Shell(None)
    count = 0
    pages = sorted(DOCS.glob("*.md"), key=lambda page: page.name != "first-test.md")
    for page in pages:
        folder = scratch / page.stem
        folder.mkdir()
        for command in commands_of(page):
            began = time.monotonic()
            shell.run(command, folder)
            count += 1
            print(f"ok   {page.name}: {command} ({time.monotonic() - began:.1f} s)", flush=True)
    assert count >= 12, count


def links_lead_somewhere():
    for page in [*DOCS.glob("*.md"), SOURCE / "README.md"]:
        text = page.read_text(encoding="utf-8")
        for target in re.findall(r"\]\(([^)#:]+)\)", text):
            assert (page.parent / target).exists(), (page.name, target)
        for target in re.findall(r"`((?:config|core|daemon|drivers|tests)/[\w./-]+\.\w+)`", text):
            assert (SOURCE / target).exists(), (page.name, target)


def main():
    if shutil.which("sqlite3") is None:
        print("skipped: sqlite3 is not installed")
        sys.exit(77)
    links_lead_somewhere()
    with tempfile.TemporaryDirectory(prefix="thermbal-docs-") as scratch:
        commands_work(pathlib.Path(scratch))


if __name__ == "__main__":
    main()
