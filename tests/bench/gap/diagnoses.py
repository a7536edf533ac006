"""Runs thermbalctl diagnose over a folder of cases. Knows nothing of the truth."""
import json
import os
import pathlib
import subprocess
import time
from concurrent.futures import ThreadPoolExecutor


def program():
    return pathlib.Path(os.environ.get("THERMBAL_BIN_DIR", "build/release/bin")) / "thermbalctl"


def diagnose(folder, holdout=True, written=False):
    """`written`: leaves out.toml and out.html in the folder, too."""
    command = [str(program()), "diagnose", str(folder / "run.csv"), "--model", str(folder / "model.toml"), "--json"]
    if holdout and (folder / "holdout.csv").exists():
        command += ["--holdout", str(folder / "holdout.csv")]
    if written:
        command += ["--write-model", str(folder / "out.toml"), "--report", str(folder / "out.html")]
    begin = time.monotonic()
    done = subprocess.run(command, capture_output=True, text=True, timeout=300)
    answer = json.loads(done.stdout) if done.returncode == 0 else {"error": done.stderr.strip()}
    answer["seconds"] = time.monotonic() - begin
    return answer


def all_of(folder, results, at_once=1, holdout=True):
    """One answer a case; kept in `results` (a folder), so that scoring again runs nothing again."""
    results.mkdir(parents=True, exist_ok=True)

    def one(case):
        kept = results / f"{case.name}.json"
        if not kept.exists():
            kept.write_text(json.dumps(diagnose(case, holdout), indent=1))
        return case.name, json.loads(kept.read_text())

    with ThreadPoolExecutor(at_once) as pool:
        return dict(pool.map(one, sorted(folder.glob("case_*"))))
