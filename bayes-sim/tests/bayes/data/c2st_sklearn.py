"""Reference numbers for the C2ST: scikit-learn's MLPClassifier with the settings of sbibm/metrics/c2st.py.

    python3 c2st_sklearn.py ../../../../shared/sbibm > c2st_sklearn.csv

Each row takes the first 4,000 points of one task's reference posterior of observation 1, in two halves, and changes the second.
Needs numpy and scikit-learn (1.9.1 made the file beside this one).
"""

import bz2
import sys
import warnings
import numpy as np
from sklearn.model_selection import KFold, cross_val_score
from sklearn.neural_network import MLPClassifier

warnings.filterwarnings("ignore")


def change(name, y):
    out = y.copy()
    if name == "scaled":
        mean = y.mean(axis=0)
        out = mean + 1.15 * (y - mean)
    elif name == "shifted":
        out = y + 0.15 * y.std(axis=0, ddof=1)
    elif name == "unpaired":  # every column rolled by its own amount: the marginals without their dependence
        for j in range(y.shape[1]):
            out[:, j] = np.roll(y[:, j], 7 * j)
    elif name == "third":  # every third point shifted: told apart or not, with no ground between
        out[::3] += 0.15 * y.std(axis=0, ddof=1)
    return out


def c2st(x, y, seed):
    mean, sd = x.mean(axis=0), x.std(axis=0, ddof=1)
    data = np.concatenate(((x - mean) / sd, (y - mean) / sd))
    target = np.concatenate((np.zeros(len(x)), np.ones(len(y))))
    d = x.shape[1]
    clf = MLPClassifier(activation="relu", hidden_layer_sizes=(10 * d, 10 * d), max_iter=10000, solver="adam", random_state=seed)
    folds = KFold(n_splits=5, shuffle=True, random_state=seed)
    return cross_val_score(clf, data, target, cv=folds, scoring="accuracy").mean()


SEEDS = 6
CHANGES = {"two_moons": ["same", "third", "unpaired"], "slcp": ["same", "scaled", "shifted", "third", "unpaired"]}

print("task,change,seed,c2st", flush=True)
for task, names in CHANGES.items():
    path = f"{sys.argv[1]}/{task}/num_observation_1/reference_posterior_samples.csv.bz2"
    rows = np.loadtxt(bz2.open(path, "rt"), delimiter=",", skiprows=1)[:4000]
    half = len(rows) // 2
    for name in names:
        y = change(name, rows[half:])
        for seed in range(1, SEEDS + 1):
            print(f"{task},{name},{seed},{c2st(rows[:half], y, seed):.5f}", flush=True)
