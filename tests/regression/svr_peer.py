"""scikit-learn as the independent party. Each line is a request:
  fit C sigma epsilon tolerance lags samples...   -> dual objective, bias, then the prediction of every row
  grid epsilon tolerance folds lags C_grid sigma_grid samples...  (grids comma-separated)
      -> mean held-out squared error of every grid point, sigma by sigma, C within, as GridSearchCV gives them
The samples are scaled to [0, 1] here, too."""
import sys

import numpy as np
from sklearn.model_selection import GridSearchCV, KFold
from sklearn.svm import SVR


def lagged(samples, lags):
    unit = np.array(samples, float)
    unit = (unit - unit.min()) / (unit.max() - unit.min())
    rows = np.array([unit[i : i + lags] for i in range(len(unit) - lags)])
    return rows, unit[lags:]


def show(values):
    print(" ".join(repr(float(v)) for v in values))


def fit(C, sigma, epsilon, tolerance, lags, *samples):
    x, y = lagged(samples, int(lags))
    C, sigma, epsilon = float(C), float(sigma), float(epsilon)
    model = SVR(kernel="rbf", gamma=1 / sigma**2, C=C, epsilon=epsilon, tol=float(tolerance), cache_size=500).fit(x, y)
    c = model.dual_coef_[0]
    s = model.support_vectors_
    kernel = np.exp(-((s[:, None] - s[None]) ** 2).sum(2) / sigma**2)
    objective = 0.5 * c @ kernel @ c - y[model.support_] @ c + epsilon * np.abs(c).sum()
    show([objective, model.intercept_[0], *model.predict(x)])


def grid(epsilon, tolerance, folds, lags, C_grid, sigma_grid, *samples):
    x, y = lagged(samples, int(lags))
    points = {
        "C": [float(c) for c in C_grid.split(",")],
        "gamma": [1 / float(s) ** 2 for s in sigma_grid.split(",")],
    }
    search = GridSearchCV(
        SVR(kernel="rbf", epsilon=float(epsilon), tol=float(tolerance)),
        points,
        scoring="neg_mean_squared_error",
        cv=KFold(int(folds)),
        refit=False,
    ).fit(x, y)
    # GridSearchCV varies gamma fastest
    error = -search.cv_results_["mean_test_score"].reshape(len(points["C"]), len(points["gamma"]))
    show(error.T.ravel())


for line in open(sys.argv[1]):
    kind, *arguments = line.split()
    {"fit": fit, "grid": grid}[kind](*arguments)
