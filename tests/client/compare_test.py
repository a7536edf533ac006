"""thermbalctl compare against answers made without it: scipy's curve_fit, a whole Fisher matrix in numpy, a known end."""
import json
import os
import subprocess
import tempfile
import unittest
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
from scipy.optimize import curve_fit

PROGRAM = os.path.join(os.environ["THERMBAL_BIN_DIR"], "thermbalctl")
MINUTE = np.arange(0.0, 400.01, 0.25)
TAU_MIN = (10.0, 48.0)
SHARES = {"T2": (0.35, 0.65), "T3": (0.7, 0.3), "T4": (0.1, 0.9), "T5": (0.35, 0.65)}
RISE_C, NOISE_C, START_C = 8.7, 0.05, 18.0


def one(t, level, a, tau):
    return level - a * np.expm1(-t / tau)


def two(t, level, a, tau, b, slow):
    return one(t, level, a, tau) - b * np.expm1(-t / slow)


def recording(folder, room_C=lambda t: np.full_like(t, START_C), name="two.csv", last_min=400.0):
    """T1 the room; the others two exponentials above where the room began, with noise; the noise-free curves too."""
    rng = np.random.default_rng(7)
    curves = {c: START_C + RISE_C * sum(s * -np.expm1(-MINUTE / tau) for s, tau in zip(shares, TAU_MIN))
              for c, shares in SHARES.items()}
    columns = {"T1": room_C(MINUTE), **{c: v + rng.normal(0.0, NOISE_C, v.size) for c, v in curves.items()}}
    path = Path(folder) / name
    rows = ["time_s," + ",".join(columns)]
    for k in range(MINUTE.size):
        if MINUTE[k] <= last_min:
            rows.append(",".join([f"{60 * MINUTE[k]:.0f}"] + [f"{values[k]:.4f}" for values in columns.values()]))
    path.write_text("\n".join(rows) + "\n")
    return str(path), columns


def run(*arguments, status=0):
    made = subprocess.run([PROGRAM, "compare", *arguments], capture_output=True, text=True, timeout=120)
    if made.returncode != status:
        raise AssertionError(f"status {made.returncode}: {made.stderr}")
    return made


def joint_half_width_C(until_min, channel):
    """1.645 standard deviations from the inverse of the Fisher matrix of every level, share and time constant."""
    t = MINUTE[MINUTE <= until_min + 1e-9]
    names = list(SHARES)
    blocks = []
    for name in names:
        own = np.column_stack([np.ones_like(t)] + [-np.expm1(-t / tau) for tau in TAU_MIN])
        common = np.column_stack([-RISE_C * share * (t / tau ** 2) * np.exp(-t / tau)
                                  for share, tau in zip(SHARES[name], TAU_MIN)])
        row = np.zeros((t.size, 3 * len(names) + 2))
        row[:, 3 * names.index(name): 3 * names.index(name) + 3] = own
        row[:, -2:] = common
        blocks.append(row)
    jacobian = np.vstack(blocks)
    scale = np.linalg.norm(jacobian, axis=0)
    covariance = np.linalg.inv((jacobian / scale).T @ (jacobian / scale)) * NOISE_C ** 2
    functional = np.zeros(jacobian.shape[1])
    functional[3 * names.index(channel): 3 * names.index(channel) + 3] = 1.0
    functional /= scale
    return 1.645 * np.sqrt(functional @ covariance @ functional)


class Compare(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.folder.cleanup)
        cls.csv, cls.columns = recording(cls.folder.name)
        cls.plot = os.path.join(cls.folder.name, "errors.svg")
        cls.document = json.loads(run(cls.csv, "--every-min", "40", "--json", "--plot", cls.plot,
                                      *sum((["--estimator", e] for e in
                                            ("one_exponential", "two_exponentials", "kalman", "modes")), [])).stdout)
        cls.channels = {channel["channel"]: channel for channel in cls.document["channels"]}

    def window(self, channel, at_min):
        return next(w for w in self.channels[channel]["windows"] if w["window_end_min"] == at_min)

    def test_exponential_fits_are_those_of_scipy(self):
        for estimator, function, start in (("one_exponential", one, (18, 8, 40)),
                                           ("two_exponentials", two, (18, 3, 8, 6, 50))):
            for channel in SHARES:
                for at_min in (120.0, 200.0, 400.0):
                    with self.subTest(estimator=estimator, channel=channel, at_min=at_min):
                        # Minutes' means of what is fitted: compare fits them, and they know what the samples know.
                        seen = int(4 * at_min) // 4 * 4
                        t = MINUTE[:seen].reshape(-1, 4).mean(axis=1)
                        y = self.columns[channel][:seen].reshape(-1, 4).mean(axis=1)
                        found, covariance = curve_fit(function, t, y, p0=start, maxfev=20000)
                        functional = np.array([1, 1, 0, 1, 0][: len(found)])
                        says = self.window(channel, at_min)["estimators"][estimator]
                        sd_C = float(np.sqrt(functional @ covariance @ functional))
                        self.assertAlmostEqual(says["steady_state_C"], float(functional @ found), delta=0.15 * sd_C + 0.002)
                        half_C = (says["steady_state_high_C"] - says["steady_state_low_C"]) / 2
                        self.assertAlmostEqual(half_C / (1.645 * sd_C), 1.0, delta=0.2)

    def test_the_truth_is_the_measured_end_and_the_error_is_against_it(self):
        for channel in SHARES:
            self.assertTrue(self.channels[channel]["end"]["settled"])
            end_C = float(np.mean(self.columns[channel][-60:]))
            self.assertAlmostEqual(self.channels[channel]["end"]["mean_C"], end_C, places=3)
            for at_min in (80.0, 240.0):
                window = self.window(channel, at_min)
                self.assertAlmostEqual(window["settles_at_C"], end_C, places=3)
                for answer in window["estimators"].values():
                    self.assertAlmostEqual(answer["error_C"], answer["steady_state_C"] - end_C, places=3)
                    self.assertEqual(answer["held"],
                                     answer["steady_state_low_C"] <= window["settles_at_C"] <= answer["steady_state_high_C"])

    def test_the_information_limit_is_the_inverse_of_the_whole_fisher_matrix(self):
        for channel in SHARES:
            for at_min in (80.0, 120.0, 200.0):
                with self.subTest(channel=channel, at_min=at_min):
                    # compare knows the time constants and the noise only from the recording: to some percent.
                    self.assertAlmostEqual(self.window(channel, at_min)["least_half_width_C"]
                                           / joint_half_width_C(at_min, channel), 1.0, delta=0.15)
        grid = np.arange(20.0, 120.0)
        earliest = grid[[joint_half_width_C(at, "T5") <= 0.2 for at in grid]][0]
        self.assertAlmostEqual(self.channels["T5"]["earliest_knowable_min"], earliest, delta=3.0)

    def test_what_knows_the_machines_shape_beats_what_does_not(self):
        worst = {name: max(abs(self.window(c, 120.0)["estimators"][name]["error_C"]) for c in SHARES)
                 for name in ("one_exponential", "modes")}
        self.assertLess(worst["modes"], 0.15)
        self.assertGreater(worst["one_exponential"], 0.3)

    def test_the_summary_is_made_of_the_windows(self):
        row = next(r for r in self.document["summary"] if r["window_end_min"] == 120.0)
        errors = [abs(self.window(c, 120.0)["estimators"]["kalman"]["error_C"]) for c in SHARES]
        self.assertAlmostEqual(row["estimators"]["kalman"]["median_error_C"], float(np.median(errors)), places=9)
        self.assertAlmostEqual(row["estimators"]["kalman"]["worst_error_C"], max(errors), places=9)

    def test_the_drawing_is_well_formed_and_has_every_line(self):
        drawing = ElementTree.parse(self.plot).getroot()
        texts = [element.text for element in drawing.iter() if element.tag.endswith("text")]
        for name in ("one_exponential", "two_exponentials", "kalman", "modes", *SHARES):
            self.assertIn(name, texts)

    def test_a_room_that_moved_is_taken_off_the_end(self):
        """The machine ends 1 C higher because the room does: at 120 min, in the cool room, it would settle lower."""
        def room_C(t):
            return START_C + np.where(t > 250.0, 1.0, 0.0) * 1.0
        path, columns = recording(self.folder.name, room_C, "warm_room.csv")
        rows = Path(path).read_text().splitlines()
        felt = -np.expm1(-np.clip(MINUTE - 250.0, 0.0, None) / 35.0)  # the channels follow the room by then
        for k, row in enumerate(rows[1:]):
            cells = row.split(",")
            rows[k + 1] = ",".join(cells[:2] + [f"{float(cell) + felt[k]:.4f}" for cell in cells[2:]])
        Path(path).write_text("\n".join(rows) + "\n")
        document = json.loads(run(path, "--every-min", "120", "--json", "--estimator", "one_exponential").stdout)
        for channel in document["channels"]:
            at_120 = channel["windows"][0]["settles_at_C"]
            self.assertAlmostEqual(at_120, float(np.mean(columns[channel["channel"]][-60:])), delta=0.08)
            self.assertAlmostEqual(channel["end"]["mean_C"], at_120 + 1.0, delta=0.08)

    def test_a_recording_that_has_not_settled_says_so(self):
        path, _ = recording(self.folder.name, name="short.csv", last_min=110.0)
        document = json.loads(run(path, "--every-min", "50", "--json", "--estimator", "kalman").stdout)
        self.assertFalse(any(channel["end"]["settled"] for channel in document["channels"]))
        self.assertIn("T5 has not settled and is left out of the summary: moved",
                      run(path, "--every-min", "50", "--estimator", "kalman").stdout)

    def test_text_and_page_for_a_person(self):
        page = os.path.join(self.folder.name, "errors.html")
        text = run(self.csv, "--every-min", "200", "--channel", "T5", "--estimator", "modes", "--plot", page).stdout
        self.assertIn("modes", text)
        self.assertIn("T5: moved", text)
        self.assertIn("<svg", Path(page).read_text())

    def test_what_a_person_can_get_wrong(self):
        for arguments, message in ((["--estimator", "guess"], "no estimator guess; there are svr, one_exponential"),
                                   (["--estimator", "modes_with_archive"], "needs earlier tests"),
                                   (["--plot", "x.png"], "ends in .html or .svg"),
                                   (["--every-min", "5000"], "which is no window; give less"),
                                   (["--channel", "T9"], "no column T9")):
            self.assertIn(message, run(self.csv, *arguments, status=2).stderr)


if __name__ == "__main__":
    unittest.main()
