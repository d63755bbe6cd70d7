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
# # The posterior of a bouncing ball
#
# A ball falls on a rough stone and bounces three times. A microphone hears when. Which restitution has the ball, and from how high did it fall?
# The simulator has chance in it: each bounce off a rough stone keeps another share of the speed.

# %%
import numpy as np

from missing_physics.bayes_sim import NPE, BoxUniform, simulate_for_sbi

GRAVITY_M_S2 = 9.80665


def bounce(theta, rng):
    """Restitution and height (m) in; the times between the first four impacts (s) out, each read to 1 ms."""
    restitution, height_m = theta
    speed = np.sqrt(2 * GRAVITY_M_S2 * height_m)
    kept = np.clip(restitution + 0.03 * rng.standard_normal(3), 0.05, 0.999)
    return 2 * speed * np.cumprod(kept) / GRAVITY_M_S2 + 1e-3 * rng.standard_normal(3)


prior = BoxUniform(low=[0.3, 0.2], high=[0.95, 2.0])
theta, x = simulate_for_sbi(bounce, prior, 2000, seed=1)
inference = NPE(prior, density_estimator="autoregressive")
posterior = inference.append_simulations(theta, x).train().build_posterior()

# %% [markdown]
# One ball, concealed: restitution 0.7, dropped from 1.2 m.

# %%
heard_s = bounce(np.array([0.7, 1.2]), np.random.default_rng(99))
draws = posterior.sample((4000,), x=heard_s, seed=2)
low, middle, high = np.quantile(draws, [0.025, 0.5, 0.975], axis=0)
for name, *values in zip(("restitution", "height in m"), low, middle, high):
    print("{}: {:.3f} to {:.3f}, median {:.3f}".format(name, values[0], values[2], values[1]))
assert np.all(low < [0.7, 1.2]) and np.all([0.7, 1.2] < high)

# %% [markdown]
# Is it right as often as it says? Of 100 more balls, drawn from the prior, the 90 % intervals should hold about 90.

# %%
truths = prior.sample((100,), seed=7)
holds = np.zeros(2)
for k, truth in enumerate(truths):
    draws = posterior.sample((500,), x=bounce(truth, np.random.default_rng([8, k])), seed=k)
    low, high = np.quantile(draws, [0.05, 0.95], axis=0)
    holds += (low < truth) & (truth < high)
print(f"90 % intervals hold {holds[0]:.0f} restitutions and {holds[1]:.0f} heights of 100")
assert np.all(holds > 75)
