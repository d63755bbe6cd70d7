# ---
# jupyter:
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
#   kernelspec:
#     display_name: Python 3
#     name: python3
# ---

# %% [markdown]
# # One's own simulator in ten lines
#
# A cart on a spring is released and recorded. The simulator can do viscous friction, dry friction and a spring that hardens; as it is used,
# all three are off.

# %%
import numpy as np

import missing_physics as mp


def predict(p, inputs, step_s=0.002):
    """Many carts at once: parameters of shape (sets,), the channel of shape (sets, rows)."""
    rows = np.rint(inputs["t_s"] / step_s).astype(int)
    x, v, track = p["x_m_at_start"], 0.0 * p["x_m_at_start"], []
    for _ in range(rows[-1] + 1):
        track.append(x)
        drive = -p["omega2_per_s2"] * x - p["cubic_per_m2_s2"] * x**3 - p["viscous_per_s"] * v
        v = v + step_s * (drive - p["dry_m_s2"] * np.tanh(v / 2e-3))
        x = x + step_s * v
    return {"x_m": np.stack(track, axis=1)[:, rows]}


model = mp.Model(
    predict,
    parameters=[
        mp.Parameter("omega2_per_s2", start=25.0, lower=1.0, scale=3.0, unit="1/s^2"),
        mp.Parameter("x_m_at_start", start="measured", scale=0.01, per_run=True, unit="m"),
    ],
    mechanisms=[
        mp.Mechanism("viscous-friction", [mp.Parameter("viscous_per_s", lower=0.0, scale=0.1)]),
        mp.Mechanism("dry-friction", [mp.Parameter("dry_m_s2", lower=0.0, scale=0.05)]),
        mp.Mechanism("hardening-spring", [mp.Parameter("cubic_per_m2_s2", scale=100.0, unit="1/(m^2 s^2)")]),
    ],
    channels=["x_m"],
    batched=True,
)

# %% [markdown]
# The cart of the recordings has dry friction, and is not simulated at all: with dry friction each half swing is a cosine about a centre that lies
# on the side it comes from.

# %%
OMEGA2, DRY_M_S2 = 27.0, 0.06


def record(released_m, seed, sigma_m=5e-4):
    t_s = np.arange(0.0, 3.0, 0.02)
    half_s, centre = np.pi / np.sqrt(OMEGA2), DRY_M_S2 / OMEGA2
    x_m, start = np.empty_like(t_s), released_m
    for k in range(int(t_s[-1] / half_s) + 1):
        of_swing = (t_s >= k * half_s) & (t_s < (k + 1) * half_s)
        about = np.sign(start) * centre
        x_m[of_swing] = about + (start - about) * np.cos(np.sqrt(OMEGA2) * (t_s[of_swing] - k * half_s))
        start = 2 * about - start
    return {"t_s": t_s, "x_m": x_m + sigma_m * np.random.default_rng(seed).standard_normal(t_s.size)}


answer = mp.diagnose(model, [record(0.10, 1), record(0.15, 2), record(-0.12, 3)])
print(answer)
assert answer.chosen == ["dry-friction"]

# %%
unseen = record(0.2, 9, sigma_m=0.0)
begun = np.where(unseen["t_s"] < 0.3, unseen["x_m"], np.nan)
predicted = answer.repaired().predict({"t_s": unseen["t_s"], "x_m": begun})
print(f"dry friction {answer.parameters['dry_m_s2'].value:.4f} m/s^2, concealed {DRY_M_S2}")
print(f"a release that was not seen: error {1e3 * np.abs(predicted['x_m'] - unseen['x_m']).max():.2f} mm at most")
