"""The manual pages and completions that are installed: sound for mandoc and groff, complete against --help, and working in
bash and zsh."""
import os
import pathlib
import re
import shutil
import subprocess
import sys

BIN = pathlib.Path(os.environ["THERMBAL_BIN_DIR"])
BUILD = BIN.parent
SOURCE = pathlib.Path(os.environ["THERMBAL_SOURCE_DIR"])
PROGRAMS = {"thermbald": 8, "thermbalctl": 1, "thermbal-sim": 1, "thermbal-mqtt": 8}


def output(*words, **more):
    done = subprocess.run(words, capture_output=True, text=True, timeout=60, **more)
    assert done.returncode == 0, (words, done.returncode, done.stdout, done.stderr)
    return done.stdout + done.stderr


def pages():
    return [BUILD / f"man/man{section}/{program}.{section}" for program, section in PROGRAMS.items()] + \
        [BUILD / "man/man5/thermbald.toml.5"]


def plain(page):
    """The page as a person reads it, without the line breaks of its paragraphs."""
    return re.sub(r".\x08", "", output("groff", "-man", "-Tutf8", "-P-c", "-rLL=1000n", str(page)))


def commands_of(help_text):
    """The subcommands that --help lists: two blanks, the name, its description, under a heading that is no list of options."""
    found, inside = [], False
    for line in help_text.splitlines():
        if line and not line.startswith(" "):
            inside = line.endswith(":") and not line.startswith(("Options", "Positionals", "Usage"))
        elif inside and (named := re.match(r"  ([a-z][a-z-]*)(\s|$)", line)):
            found.append(named.group(1))
    return found


def flags_of(help_text):
    return {flag for line in help_text.splitlines() if re.match(r"\s+-", line)
            for flag in re.findall(r"(?<![\w-])--?[a-zA-Z][\w-]*", re.split(r" (?:Excludes|Needs):|  ", line.strip())[0])}


def every_command(program, words=()):
    help_text = output(str(BIN / program), *words, "--help")
    yield words, help_text
    for command in commands_of(help_text):
        if program == "thermbalctl":
            yield from every_command(program, (*words, command))


def the_pages_are_sound():
    for page in pages():
        assert page.stat().st_size > 500, page
        if shutil.which("mandoc"):
            complaints = [line for line in subprocess.run(
                ["mandoc", "-Tlint", "-Wwarning", str(page)], capture_output=True, text=True, timeout=60).stdout.splitlines()
                # The date is left out, so that the same sources make the same pages.
                if "missing date" not in line and "TH" not in line.split(": ")[-1][:3]]
            assert not complaints, complaints
        done = subprocess.run(["groff", "-man", "-ww", "-Tutf8", "-z", str(page)], capture_output=True, text=True, timeout=60)
        assert (done.returncode, done.stderr) == (0, ""), (page, done.stderr)


def every_option_is_on_its_page():
    counted = 0
    for program, section in PROGRAMS.items():
        text = plain(BUILD / f"man/man{section}/{program}.{section}")
        for words, help_text in every_command(program):
            flags = flags_of(help_text)
            assert flags, (program, words)
            part = text
            if words:
                heading = re.search(rf"^\s+{re.escape(' '.join(words))} \[", text, re.M)
                assert heading, (program, words)
                part = text[heading.start():]
            for flag in flags:
                assert re.search(rf"(?<![\w-]){re.escape(flag)}(?![\w-])", part), (program, words, flag)
                counted += 1
    assert counted > 150, counted


def every_key_is_in_thermbald_toml():
    text = plain(BUILD / "man/man5/thermbald.toml.5")
    keys = set()
    for line in (SOURCE / "config/README.md").read_text(encoding="utf-8").split("## Writing a profile")[0].splitlines():
        if line.startswith("| ") and not line.startswith("| key"):
            keys.update(re.findall(r"`([a-z_A-Z]+)`", line.split("|")[1]))
    assert len(keys) > 40, keys
    missing = sorted(key for key in keys if not re.search(rf"\b{key}\b", text))
    assert not missing, missing


def completed(words):
    """What bash offers for the last of these words."""
    script = BUILD / "completion/bash" / words[0]
    line = " ".join(f"'{word}'" for word in words)
    text = output("bash", "--norc", "-c", f"source '{script}'; COMP_WORDS=({line}); COMP_CWORD={len(words) - 1}; "
                  f"_{words[0].replace('-', '_')}; printf '%s\\n' \"${{COMPREPLY[@]}}\"")
    return set(text.split())


def bash_completes():
    assert {"status", "replay", "new", "demo", "metrics"} <= completed(["thermbalctl", ""])
    assert completed(["thermbalctl", "rep"]) >= {"replay"}
    assert "status" not in completed(["thermbalctl", "rep"])
    assert {"tcp", "rtu"} <= completed(["thermbalctl", "probe", ""])
    assert {"--baud", "--parity"} <= completed(["thermbalctl", "probe", "rtu", "--"])
    assert "--baud" not in completed(["thermbalctl", "probe", "tcp", "--"])
    assert {"--tolerance-C", "--json"} <= completed(["thermbalctl", "replay", "file.csv", "--"])
    assert completed(["thermbalctl", "export", "--csv", ""]) == set(), "a value: the shell's own files"
    assert "--check-config" in completed(["thermbald", "--ch"])
    assert "--lockstep" in completed(["thermbal-sim", "--lo"])
    assert "--print-manual" not in completed(["thermbalctl", "--"])


def zsh_reads_its_completion():
    if shutil.which("zsh") is None:
        print("zsh is not installed: its completion was not tried")
        return
    for program in PROGRAMS:
        script = BUILD / "completion/zsh" / f"_{program}"
        output("zsh", "-f", "-n", str(script))
        function = "_" + program.replace("-", "_")
        # _describe is stood in for: it prints the lists that it is given.
        offered = output("zsh", "-f", "-c", f"compdef() {{ : }}; _files() {{ : }}; _describe() {{ print -l -- ${{(P)2}} }}; "
                         f"source {script}; words=({program} ''); CURRENT=2; {function}; words=({program} --); {function}")
        assert "--help:" in offered, (program, offered)
    offered = output("zsh", "-f", "-c", f"compdef() {{ : }}; _describe() {{ print -l -- ${{(P)2}} }}; source "
                     f"{BUILD}/completion/zsh/_thermbalctl; words=(thermbalctl probe ''); CURRENT=3; _thermbalctl")
    assert offered.startswith(("tcp:", "rtu:")), offered


if __name__ == "__main__":
    if shutil.which("groff") is None:
        print("skipped: groff is not installed")
        sys.exit(77)
    for test in (the_pages_are_sound, every_option_is_on_its_page, every_key_is_in_thermbald_toml, bash_completes,
                 zsh_reads_its_completion):
        test()
        print(f"ok   {test.__name__}")
