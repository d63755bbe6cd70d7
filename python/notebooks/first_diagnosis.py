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
# # A first diagnosis
#
# Balls are dropped and tracked by a camera. The simulation is free fall; what does it leave out?

# %%
import numpy as np

import missing_physics as mp

DRAG_PER_M, GRAVITY_M_S2 = 0.02, 9.80665
rng = np.random.default_rng(1)
t_s = np.arange(0.0, 1.6, 1 / 30)


def drop(height_m, sigma_m=0.004):
    """A drop with quadratic drag, in closed form, read with noise."""
    fallen_m = np.log(np.cosh(t_s * np.sqrt(GRAVITY_M_S2 * DRAG_PER_M))) / DRAG_PER_M
    return {"t_s": t_s, "z_m": height_m - fallen_m + sigma_m * rng.standard_normal(t_s.size)}


runs = [drop(height_m) for height_m in (12.0, 13.0, 14.0)]

# %% [markdown]
# The domain `trajectory` knows balls in the air. `mp.domains()` lists all domains, with the columns that they read and the mechanisms that they know.

# %%
answer = mp.diagnose(domain="trajectory", runs=runs, rig={"mass_kg": 0.058})
print(answer)
answer  # in a notebook: the report, with pictures

# %%
low, high = answer.parameters["k_per_m"].ci95
print(f"verdict {answer.verdict}: {answer.chosen}, drag {low:.5f} to {high:.5f} 1/m, concealed {DRAG_PER_M} 1/m")
assert answer.chosen == ["quadratic-drag"] and low < DRAG_PER_M < high

# %% [markdown]
# All that was tried, as a table (with pandas):

# %%
print(answer.to_dataframe().head())

# %% [markdown]
# The repaired model predicts a drop of which half a second was seen:

# %%
unseen = drop(15.0, sigma_m=0.0)
begun = np.where(t_s < 0.5, unseen["z_m"], np.nan)
predicted = answer.repaired().predict({"t_s": t_s, "z_m": begun})
error_m = np.abs(predicted["z_m"] - unseen["z_m"]).max()
vacuum_m = np.abs(15.0 - 0.5 * GRAVITY_M_S2 * t_s**2 - unseen["z_m"]).max()
print(f"largest error {error_m:.4f} m; free fall's {vacuum_m:.3f} m")
assert error_m < 0.03
