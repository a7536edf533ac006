"""Compares diagnoses with the truth."""
import collections
import math
import statistics

ONSET_TOLERANCE_S = 600.0


def named(answer):
    return answer.get("effects", [])


def first_kind(answer):
    return named(answer)[0]["kind"] if named(answer) else answer.get("verdict", "error")


def candidates(effect):
    """kind -> probability of one reported effect, its alternatives included."""
    found = collections.Counter({effect["kind"]: effect["probability"]})
    for other in effect.get("alternatives", []):
        found[other["kind"]] += other["probability"]
    return found


def probability_of(answer, kind):
    return max((candidates(e)[kind] for e in named(answer)), default=answer.get("candidates", {}).get(kind, 0.0))


def place_is_right(effect, truth):
    if truth["at"] in ("all", "ambient"):
        return True
    words = effect["at"].replace("-", " ").replace(",", " ").split()
    near = {truth["at"], truth["node"], *truth["neighbours"]}
    return any(word in near for word in words)


def onset_is_right(effect, truth):
    return "onset_s" not in truth or abs(effect["from_s"] - truth["onset_s"]) <= ONSET_TOLERANCE_S


def holdout_gap_C(answer, truth):
    """Of the calibrated model, above the floor; None without a held-out run."""
    before = answer.get("gap", {}).get("holdout_before_rmse_C")
    return None if before is None else before - truth["holdout_floor_C"]


def counted(share_closed):
    """In a mean a gap that has grown counts for no more than -1."""
    return max(share_closed, -1.0)


def gap_closed(answer, truth):
    gap_C, floor = holdout_gap_C(answer, truth), truth["holdout_floor_C"]
    if gap_C is None or gap_C < 0.25 * floor:
        return None  # nothing to close
    return 1 - (answer["gap"]["holdout_after_rmse_C"] - floor) / gap_C


def parameter_error(effect, truth):
    for name, true in truth["parameters"].items():
        found = effect["parameters"].get(name)
        if found is not None and true:
            return abs(found / true - 1)
    return None


def share(hits):
    hits = list(hits)
    return (sum(hits) / len(hits) if hits else math.nan), len(hits)


def wilson(rate, count, z=1.96):
    if not count:
        return math.nan, math.nan
    centre = (rate + z * z / (2 * count)) / (1 + z * z / count)
    half = z / (1 + z * z / count) * math.sqrt(rate * (1 - rate) / count + z * z / (4 * count * count))
    return centre - half, centre + half


class Score:
    """All figures of a set of cases: `pairs` are (answer, truth)."""

    def __init__(self, pairs):
        self.pairs = pairs
        self.single = [(a, t) for a, t in pairs if len(t["effects"]) == 1 and t["effects"][0]["inside_catalogue"]]
        self.none = [(a, t) for a, t in pairs if not t["effects"]]
        self.outside = [(a, t) for a, t in pairs if any(not e["inside_catalogue"] for e in t["effects"])]
        self.double = [(a, t) for a, t in pairs if len(t["effects"]) == 2]

    def right_first(self, low, high=math.inf, kinds=None):
        return share(first_kind(a) == t["effects"][0]["kind"] for a, t in self.single
                     if low <= t["strength"] < high and (kinds is None or t["effects"][0]["kind"] in kinds))

    def reported(self):
        return share(probability_of(a, t["effects"][0]["kind"]) >= 0.05 for a, t in self.single if t["strength"] >= 12)

    def false_names(self):
        return share(bool(named(a)) for a, _ in self.none)

    def outside_named(self):
        return share(any(e["probability"] > 0.5 for e in named(a)) for a, _ in self.outside)

    def _right(self):
        return [(named(a)[0], t["effects"][0]) for a, t in self.single if first_kind(a) == t["effects"][0]["kind"]]

    def places(self):
        return share(place_is_right(e, t) and onset_is_right(e, t) for e, t in self._right())

    def with_holdout_gap(self):
        """(share closed as it counts, gap in C), a strong case each that has something to close."""
        strong = [(a, t) for a, t in self.single + self.double if t["strength"] >= 12]
        return [(counted(share), holdout_gap_C(a, t)) for a, t in strong if (share := gap_closed(a, t)) is not None]

    def holdout_gap(self):
        closed = [share for share, _ in self.with_holdout_gap()]
        return (statistics.mean(closed) if closed else math.nan), len(closed)

    def both_of_pair(self):
        return share({e["kind"] for e in t["effects"]} <= {e["kind"] for e in named(a)} for a, t in self.double)

    def parameter(self):
        errors = [parameter_error(e, t) for e, t in self._right()]
        errors = [e for e in errors if e is not None]
        return (statistics.median(errors) if errors else math.nan), len(errors)

    def brier(self):
        """Of the statement "the first name is right", over every case that got a name."""
        terms = []
        for answer, truth in self.pairs:
            for effect in named(answer):
                right = effect["kind"] in {e["kind"] for e in truth["effects"]}
                terms.append((effect["probability"] - right) ** 2)
        return (statistics.mean(terms) if terms else math.nan), len(terms)

    def seconds(self):
        times = [a["seconds"] for a, _ in self.pairs]
        return (max(times), len(times)) if times else (math.nan, 0)

    def figures(self):
        return [("right name first, strength 12 and over", ">= 0.95", *self.right_first(12)),
                ("right name first, strength 5", ">= 0.70", *self.right_first(4, 7)),
                ("true effect reported with 5 % or more, strength 12 and over", ">= 0.95", *self.reported()),
                ("effect-free runs that get a name", "<= 0.03", *self.false_names()),
                ("outside the catalogue, named with over 50 %", "<= 0.20", *self.outside_named()),
                ("place right, onset within 10 min", ">= 0.92", *self.places()),
                ("gap closed on the held-out run", ">= 0.88", *self.holdout_gap()),
                ("both effects of a pair", ">= 0.75", *self.both_of_pair()),
                ("main parameter, median error", "<= 0.15", *self.parameter()),
                ("Brier score", "<= 0.14", *self.brier()),
                ("longest case, s", "< 10", *self.seconds())]

    def confusion(self):
        """truth -> Counter of first names; pairs count once, as "pair"."""
        rows = collections.defaultdict(collections.Counter)
        for answer, truth in self.pairs:
            kinds = [e["kind"] for e in truth["effects"]]
            row = "none" if not kinds else kinds[0] if len(kinds) == 1 else "+".join(kinds)
            rows[row][first_kind(answer)] += 1
        return rows
