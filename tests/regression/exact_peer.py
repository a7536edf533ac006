"""The exact optimum in double precision, independent of our solver: from scikit-learn's support vectors (whose kernel is in single
precision), the active set is corrected row by row until the optimality conditions hold. Each line:
C sigma epsilon lags samples...; answers the steady state of the free run in C, or `nan` where no active set was found in
400 corrections."""
import sys

import numpy as np
from sklearn.svm import SVR


def optimum(x, y, C, sigma, epsilon):
    """Coefficients and bias with all optimality conditions met to 1e-10, or None."""
    kernel = np.exp(-((x[:, None] - x[None]) ** 2).sum(2) / sigma**2)
    model = SVR(C=C, gamma=1 / sigma**2, epsilon=epsilon, tol=1e-7, max_iter=5_000_000).fit(x, y)
    start = np.zeros(len(y))
    start[model.support_] = model.dual_coef_[0]
    # 0 inside the tube, +-1 on its edge, +-2 held back by C
    state = (np.sign(start) * np.where(abs(start) >= C * (1 - 1e-7), 2, 1)).astype(int)
    for _ in range(400):
        edge, bound, inside = (np.where(abs(state) == k)[0] for k in (1, 2, 0))
        c = np.zeros(len(y))
        c[bound] = C * np.sign(state[bound])
        system = np.ones((len(edge) + 1,) * 2)
        system[:-1, :-1] = kernel[np.ix_(edge, edge)]
        system[-1, -1] = 0
        right = np.append(y[edge] - epsilon * state[edge] - kernel[np.ix_(edge, bound)] @ c[bound], -c[bound].sum())
        *c[edge], bias = np.linalg.solve(system, right)
        residual = y - kernel @ c - bias
        violation = np.zeros(len(y))
        violation[edge] = np.maximum(-c[edge] * np.sign(state[edge]), abs(c[edge]) - C) / C
        violation[inside] = (abs(residual[inside]) - epsilon) * 1e3
        violation[bound] = (epsilon - residual[bound] * np.sign(state[bound])) * 1e3
        worst = violation.argmax()
        if violation[worst] < 1e-7:
            return c, bias
        if state[worst] == 0:
            state[worst] = np.sign(residual[worst])
        elif abs(state[worst]) == 2:
            state[worst] //= 2
        else:
            state[worst] = 2 * state[worst] if c[worst] * state[worst] > C else 0
    return None


def steady_state(x, c, bias, sigma, history):
    history, lags = list(history), x.shape[1]
    support = x[c != 0], c[c != 0]
    for step in range(6000):
        newest = np.array(history[-lags:])
        history.append(bias + support[1] @ np.exp(-((support[0] - newest) ** 2).sum(1) / sigma**2))
        if step > 300 and abs(history[-1] - history[-100]) < 1e-7:
            return history[-1]
    return float("nan")


for line in open(sys.argv[1]):
    C, sigma, epsilon, lags, *samples = map(float, line.split())
    lags = int(lags)
    temperature = np.array(samples)
    unit = (temperature - temperature.min()) / np.ptp(temperature)
    x = np.array([unit[i : i + lags] for i in range(len(unit) - lags)])
    found = optimum(x, unit[lags:], C, sigma, epsilon)
    end = steady_state(x, *found, sigma, unit[-lags:]) if found else float("nan")
    print(temperature.min() + np.ptp(temperature) * end)
