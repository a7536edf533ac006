"""The literal pipeline by scikit-learn, for side_by_side. Each line: lags C sigma C_grid sigma_grid samples... (C and sigma as
chosen by the other side). Answers: CPU seconds for the whole grid of one n, its best C, sigma and error, the error at the
other side's point, and the steady state of the free run there (fitted with a tight tolerance)."""
import sys
import time

import numpy as np
from sklearn.model_selection import KFold
from sklearn.svm import SVR


def steady_state(model, newest):
    history = list(newest)
    run = []
    for _ in range(6000):
        run.append(model.predict([history])[0])
        history = history[1:] + [run[-1]]
        if len(run) > 200 and abs(run[-1] - run[-101]) < 1e-6:
            break
    return run[-1]


for line in open(sys.argv[1]):
    lags, C, sigma, C_grid, sigma_grid, *samples = line.split()
    lags = int(lags)
    temperature = np.array(samples, float)
    unit = (temperature - temperature.min()) / np.ptp(temperature)
    x = np.array([unit[i : i + lags] for i in range(len(unit) - lags)])
    y = unit[lags:]
    folds = list(KFold(5).split(x))
    started = time.process_time()
    errors = {}
    for s in map(float, sigma_grid.split(",")):
        for c in map(float, C_grid.split(",")):
            mse = 0.0
            for training, held_out in folds:
                model = SVR(gamma=1 / s**2, C=c, epsilon=0.001, cache_size=200).fit(x[training], y[training])
                mse += np.mean((model.predict(x[held_out]) - y[held_out]) ** 2) / len(folds)
            errors[c, s] = mse**0.5
    seconds = time.process_time() - started
    best = min(errors, key=errors.get)
    tight = SVR(gamma=1 / float(sigma) ** 2, C=float(C), epsilon=0.001, tol=1e-7, max_iter=20_000_000).fit(x, y)
    steady = temperature.min() + np.ptp(temperature) * steady_state(tight, unit[-lags:])
    print(seconds, *best, errors[best], errors[float(C), float(sigma)], steady, flush=True)
