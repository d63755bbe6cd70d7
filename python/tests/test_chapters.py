"""Posteriors and contacts."""

import pickle

import numpy as np
import pytest

from missing_physics import errors, hertz_contact
from missing_physics.bayes_sim import NPE, BoxUniform, simulate_for_sbi


def noisy(theta, rng):
    return theta + 0.1 * rng.standard_normal(theta.size)


@pytest.mark.parametrize("kind", ["mdn", "mdrff", "autoregressive"])
def test_a_posterior_is_the_known_one(kind):
    """A Gaussian reading of a flat prior, away from its bounds: the posterior is N(x, 0.1^2)."""
    prior = BoxUniform([0.0, 0.0], [1.0, 1.0])
    theta, x = simulate_for_sbi(noisy, prior, 600, seed=3)
    posterior = NPE(prior, kind).append_simulations(theta, x).train(max_num_epochs=60).build_posterior()
    draws = posterior.sample(2000, x=[0.5, 0.4], seed=4)
    assert draws.shape == (2000, 2)
    assert np.allclose(draws.mean(0), [0.5, 0.4], atol=0.04) and np.allclose(draws.std(0), 0.1, atol=0.03)
    at = posterior.set_default_x([0.5, 0.4])
    assert at.log_prob([[0.5, 0.4], [0.8, 0.4], [1.5, 0.4]])[:2].argmax() == 0
    assert at.log_prob([[1.5, 0.4]])[0] == -np.inf
    assert np.array_equal(pickle.loads(pickle.dumps(at)).sample(5), at.sample(5))


def test_simulations_are_the_same_again_and_failures_left_out():
    prior = BoxUniform([0.0], [1.0])
    fails = lambda theta, rng: [np.nan] if theta[0] > 0.5 else theta
    theta, x = simulate_for_sbi(fails, prior, 40)
    assert len(theta) == 24 and np.array_equal(theta, x) and theta.max() <= 0.5
    assert all(np.array_equal(a, b) for a, b in zip(simulate_for_sbi(noisy, prior, 9), simulate_for_sbi(noisy, prior, 9)))
    with pytest.raises(errors.PosteriorError, match="24 rows are too few: at least 50"):
        NPE(prior).append_simulations(theta, x).train()
    with pytest.raises(errors.PosteriorError, match='no density "flow", expected "mdn"'):
        NPE(prior, "flow").append_simulations(*simulate_for_sbi(noisy, prior, 60)).train()
    with pytest.raises(errors.PosteriorError):
        BoxUniform([1.0], [0.0])


def test_a_modulus_is_found():
    """Hertz in closed form, contact at 0.33 mm, an offset."""
    stage_m = np.arange(200) * 5e-6
    depth = np.clip(stage_m - 0.33e-3, 0, None)
    force_n = 4 / 3 * 10e3 / 0.75 * np.sqrt(0.01) * depth**1.5 + 2.5e-3
    force_n = force_n + 2e-5 * np.random.default_rng(1).standard_normal(200)
    found = hertz_contact.fit([(stage_m, force_n)], radius_m=0.01)
    assert found.ci95_pa[0] < 10e3 < found.ci95_pa[1] and found.modulus_pa == pytest.approx(10e3, rel=0.05)
    assert found.curves[0].contact_m == pytest.approx(0.33e-3, abs=0.02e-3)
    with pytest.raises(errors.ChapterError, match="no contact"):
        hertz_contact.fit([(stage_m, np.zeros(200) + 1e-5 * stage_m)], radius_m=0.01)
    with pytest.raises(errors.ChapterError, match="angle_rad"):
        hertz_contact.fit([(stage_m, force_n)], shape="cone")
