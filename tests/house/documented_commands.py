"""What a page says to run can be run: a command of a Markdown page that begins with a script of the project finds it there,
executable, with an interpreter in its first line."""
import os
import pathlib
import re
import sys

from outcome import conclude

SOURCE = pathlib.Path(os.environ["THERMBAL_SOURCE_DIR"])
BEFORE = re.compile(r"(?:[A-Z][A-Z_0-9]*=\S+|nice|-n|\d+|\$|sudo|\.\.\.)\s+")
SCRIPT = re.compile(r"(?:\./)?((?:tests|\.ci|\.packaging)/[\w./-]+\.(?:py|sh)|\.ci/\w+)(?=\s|$)")


def commands(text):
    """Lines of code, indented or fenced, and what stands between backticks with arguments behind it."""
    yield from re.findall(r"^ {4}(\S.*)$", text, re.M)
    for block in re.findall(r"^```\w*\n(.*?)^```", text, re.M | re.S):
        yield from block.splitlines()
    yield from (span for span in re.findall(r"`([^`\n]+)`", text) if " " in span)


def script_of(command):
    rest = command.strip()
    while before := BEFORE.match(rest):
        rest = rest[before.end():]
    script = SCRIPT.match(rest)
    return script and script[1]


def mistake(script):
    path = SOURCE / script
    if not path.is_file():
        return "is not there"
    if not os.access(path, os.X_OK):
        return "is not executable"
    return "" if path.read_bytes().startswith(b"#!") else "has no interpreter in its first line"


def main():
    pages = [page for page in sorted(SOURCE.rglob("*.md")) if page.relative_to(SOURCE).parts[0] != "build"]
    seen, wrong = set(), []
    for page in pages:
        for command in commands(page.read_text(encoding="utf-8")):
            script = script_of(command)
            if not script:
                continue
            seen.add(script)
            if what := mistake(script):
                wrong.append(f"{page.relative_to(SOURCE)}: {script} {what}")
    return conclude(wrong, len(seen), 10, "scripts of the pages can be run")


if __name__ == "__main__":
    sys.exit(main())
