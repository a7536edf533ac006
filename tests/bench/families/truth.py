"""What a run's truth file says about one channel at one moment (format: tests/truth/README.md)."""
import json
from pathlib import Path

import numpy as np

WHOLE_TEST_MIN = 400.0


class Truth:
    def __init__(self, path):
        self.raw = json.loads(Path(path).read_text())
        self.group, self.file = self.raw["group"], self.raw["file"]
        self.channels = self.raw["channels"]
        self._from = [r["from_min"] for r in self.raw["regimes"]]

    def regime_at(self, at_min):
        return max(i for i, start in enumerate(self._from) if start <= at_min or i == 0)

    def settle_C(self, channel, at_min, regime=None):
        """Where the channel settles while the room stays at its mean over the 15 min before `at_min`."""
        regime = self.regime_at(at_min) if regime is None else regime
        means = self.raw["room_mean_15min_C"]
        room_C = np.interp(at_min, self.raw["room_mean_step_min"] * np.arange(len(means)), means)
        return float(np.interp(room_C, self.raw["room_grid_C"], self.channels[channel]["settle_C"][regime]))

    def start_C(self, channel):
        c = self.channels[channel]
        return c["settle_at_end_C"] - c["rise_C"]

    def tolerance_C(self, channel, at_min):
        """An error over this is a wrong equilibrium: max(0.3 C, 5 % of the rise)."""
        return max(0.3, 0.05 * abs(self.settle_C(channel, at_min) - self.start_C(channel)))

    def limit_min(self, channel, at_min):
        return self.raw["regimes"][self.regime_at(at_min)]["information"]["limit_min"].get(channel)


def wilson(hits, of, z=1.96):
    """95 % interval of a share."""
    if of == 0:
        return float("nan"), float("nan")
    p = hits / of
    middle, half = p + z * z / (2 * of), z * np.sqrt(p * (1 - p) / of + z * z / (4 * of * of))
    return (middle - half) / (1 + z * z / of), (middle + half) / (1 + z * z / of)


def runs_of(folder):
    """(csv, Truth) of every run of a corpus, in the order of their names."""
    found = [
        (p.with_name(p.name.replace(".truth.json", ".csv")), Truth(p))
        for p in sorted(Path(folder).glob("*.truth.json"))
    ]
    if not found:
        raise SystemExit(
            f"{folder}: no *.truth.json here; make runs with tests/truth/make_corpus.py --out {folder}"
        )
    return found
