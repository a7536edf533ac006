#!/usr/bin/python3
"""How the newest samples of a warm-up fare at the end of the window under different ways of going on beyond it: the
measurement behind DenoiseOptions' defaults (core/filter/README.md). Prints mC: bias and standard deviation of the last
1, 5 and 20 samples, root mean square over the window, bias of the first 5 samples.
PyWavelets, db4, soft universal threshold; room 18 C, rise 8.7 K, 15 s, noise 0.05 C, rounding 0.1 C."""
import numpy as np
import pywt

PLANTS = {  # (share, minutes)
    "two": [(0.35, 10), (0.65, 48)],
    "three": [(0.2, 4), (0.3, 15), (0.5, 60)],
}


def truth(plant, samples):
    t = 0.25 * np.arange(samples)
    return 18 + 8.7 * (1 - sum(share * np.exp(-t / minutes) for share, minutes in PLANTS[plant]))


def denoise(x, mode, level, margin=0):
    noise = np.median(abs(pywt.dwt(x[margin : len(x) - margin], "db4", mode="smooth")[1])) / 0.6745
    threshold = noise * np.sqrt(2 * np.log(len(x) - 2 * margin))
    c = pywt.wavedec(x, "db4", mode=mode, level=level)
    c = [c[0]] + [pywt.threshold(d, threshold, "soft") for d in c[1:]]
    y = pywt.waverec(c, "db4", mode=mode)
    return y[margin : len(x) - margin]


def fitted(y, degree, at):
    span = len(y)
    return np.polyval(np.polyfit(np.arange(-span + 1, 1) / span, y, degree), np.asarray(at) / span)


def polynomial(x, level, newest, oldest):
    margin = 8 * 2**level
    beyond = np.arange(1, margin + 1)
    half = len(x) // 2
    after = fitted(x[-min(newest[1], half) :], newest[0], beyond)
    before = fitted(x[: min(oldest[1], half)][::-1], oldest[0], beyond)[::-1]
    return denoise(np.concatenate([before, x, after]), "smooth", level, margin)


def odd_reflection(x, level, degree, span):
    """Reflection through the fitted end value instead of the newest, noisy sample."""
    margin = min(8 * 2**level, len(x) - 2)
    after = 2 * fitted(x[-span:], degree, 0) - x[-2 : -margin - 2 : -1]
    before = 2 * fitted(x[:span][::-1], degree, 0) - x[margin:0:-1]
    return denoise(np.concatenate([before, x, after]), "smooth", level, margin)


METHODS = {}
for L in (4, 5):
    for mode in ("smooth", "antireflect", "symmetric"):
        METHODS[f"boundary mode {mode}, level {L}"] = lambda x, L=L, mode=mode: denoise(
            x, mode, min(L, pywt.dwt_max_level(len(x), 8))
        )
    for degree, span in ((1, 20), (2, 60)):
        METHODS[f"odd reflection at degree {degree} over {span}, level {L}"] = (
            lambda x, L=L, degree=degree, span=span: odd_reflection(x, L, degree, span)
        )
    for newest in ((1, 20), (1, 40), (2, 40), (2, 80), (3, 80), (3, 120)):
        METHODS[f"polynomial of degree {newest[0]} over {newest[1]}, level {L}"] = (
            lambda x, L=L, newest=newest: polynomial(x, L, newest, (2, 20))
        )

for plant, samples in (("two", 192), ("three", 480), ("three", 1600)):
    print(f"\n{plant} constants, {samples} samples")
    for name, method in METHODS.items():
        random = np.random.default_rng(1)
        exact = truth(plant, samples)
        errors = np.array(
            [
                method(np.round((exact + random.normal(0, 0.05, samples)) * 10) / 10)[:samples] - exact
                for _ in range(300)
            ]
        )
        newest = "  ".join(
            f"{1000 * errors[:, -k:].mean():+6.1f} {1000 * errors[:, -k:].std(0).mean():5.1f}" for k in (1, 5, 20)
        )
        rms = 1000 * np.sqrt((errors**2).mean())
        print(f"{name:50s} {newest}  {rms:5.1f}  {1000 * errors[:, :5].mean():+6.1f}")
