"""Posteriors and contacts."""

import pickle

import numpy as np
import pytest

from missing_physics import bounce_audio, errors, granular_infer, hertz_contact, liquid_haptics
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


BOTTLE = liquid_haptics.Cylinder(radius_m=0.040, length_m=0.160, wall_m=0.001)
HELD = liquid_haptics.Grasp(container_mass_kg=0.1, gripper_mass_kg=0.9, grasp_height_m=0.12, shell_center_m=0.08)


def noisy_poses(tilt_rad, sigma_nm=5e-4):
    rng = np.random.default_rng(5)
    read = liquid_haptics.readings(BOTTLE, HELD, tilt_rad, mass_kg=0.28, volume_m3=300e-6)
    forces = [force + 0.02 * rng.standard_normal(force.size) for force in (read.fx_n, read.fy_n)]
    return liquid_haptics.Poses(read.tilt_rad, *forces, read.tau_z_nm + sigma_nm * rng.standard_normal(read.tilt_rad.size))


def test_the_volume_behind_poses_is_found():
    tilts = np.radians(np.arange(0, 181, 10))
    upright = liquid_haptics.readings(BOTTLE, HELD, 0.0, mass_kg=0.28, volume_m3=300e-6)
    assert upright.fy_n[0] == pytest.approx(-1.28 * 9.80665) and abs(upright.tau_z_nm[0]) < 1e-12
    found = liquid_haptics.volume(BOTTLE, HELD, noisy_poses(tilts))
    assert found.verdict == "determined" and found.ci95_m3[0] < 300e-6 < found.ci95_m3[1]
    assert found.volume_m3 == pytest.approx(300e-6, rel=0.03) and found.mass_kg == pytest.approx(0.28, abs=0.02)
    few = liquid_haptics.volume(BOTTLE, HELD, noisy_poses(tilts[2:4]), mass_kg=(0.28, 0.005), sigma_nm=5e-4, next_of=36)
    assert few.next_tilt_rad > 1.0 and few.ci95_m3[1] - few.ci95_m3[0] > found.ci95_m3[1] - found.ci95_m3[0]
    with pytest.raises(errors.ChapterError, match="one length"):
        liquid_haptics.volume(BOTTLE, HELD, liquid_haptics.Poses(tilts, tilts, tilts, tilts[:3]))
    with pytest.raises(errors.ChapterError, match="radius_m"):
        liquid_haptics.pour_plan(liquid_haptics.Cylinder(-1.0, 0.1), 1e-4, 1e-5)


def test_a_pour_leaves_what_geometry_says():
    """What stays of a cylinder at a tilt is what lies below the rim's lowest point, counted on a grid."""
    plan = liquid_haptics.pour_plan(BOTTLE, 400e-6, 100e-6, flow_m3_s=10e-6)
    x, y, z = np.meshgrid(*[np.linspace(-0.039, 0.039, 157)] * 2, np.linspace(0.001, 0.159, 317), indexing="ij")
    inside = x**2 + y**2 <= 0.039**2
    sin, cos = np.sin(plan.tilt_rad), np.cos(plan.tilt_rad)
    below = -x * sin + z * cos <= 0.159 * cos - 0.039 * sin
    stays = np.mean(below[inside]) * np.pi * 0.039**2 * 0.158
    assert stays == pytest.approx(300e-6, rel=0.01)
    assert plan.start_tilt_rad < plan.tilt_rad and plan.tilt_rate_rad_s > 0 and plan.most_m3 <= 400e-6
    with pytest.raises(errors.ChapterError, match="poured|pourable"):
        liquid_haptics.pour_plan(BOTTLE, 400e-6, 500e-6)


def test_impacts_are_heard_and_placed():
    """Clicks that reach each microphone after its distance over the speed of sound."""
    rate_hz, rng = 48_000.0, np.random.default_rng(3)
    microphones = np.array([[0.0, 0.0, 0.08], [0.6, 0.0, 0.08], [0.3, 0.5, 0.08]])
    impacts = [(0.3, (0.2, 0.15)), (0.8, (0.4, 0.3))]
    t_s = np.arange(int(1.2 * rate_hz)) / rate_hz
    sound = 1e-3 * rng.standard_normal((3, t_s.size))
    for at_s, (x, y) in impacts:
        for channel, place in zip(sound, microphones):
            since = t_s - at_s - np.linalg.norm(place - [x, y, 0.0]) / 343.0
            click = np.exp(-np.clip(since, 0, None) / 1e-3) * np.sin(2 * np.pi * 6000 * since) * np.exp(-np.clip(since, 0, None) / 4e-4)
            channel += 0.3 * np.where(since >= 0, click, 0.0)
    heard = bounce_audio.hear(sound, rate_hz, microphones_m=microphones)
    assert len(heard.impacts) == 2 and not heard.strays
    for impact, (at_s, place) in zip(heard.impacts, impacts):
        assert impact.t_s == pytest.approx(at_s, abs=2e-4) and impact.place_m == pytest.approx(place, abs=0.01)
        assert impact.covariance_m2.shape == (2, 2) and impact.arrivals_s.shape == (3,)
    assert [impact.place_m for impact in bounce_audio.hear(sound[0], rate_hz).impacts] == [None, None]
    with pytest.raises(errors.ArrayError, match=r"microphones_m has the shape \(3, 2\)"):
        bounce_audio.hear(sound, rate_hz, microphones_m=microphones[:, :2])
    with pytest.raises(errors.ChapterError, match="2 microphones for 3 channels"):
        bounce_audio.hear(sound, rate_hz, microphones_m=microphones[:2])


def test_a_pour_tells_its_grains():
    poured = granular_infer.pour(seed=2)
    assert poured.positions_m.shape == (600, 3) and poured.statistics.shape == (16,) == (len(granular_infer.STATISTICS),)
    assert np.array_equal(granular_infer.pour(seed=2).positions_m, poured.positions_m)
    inferred = granular_infer.infer(poured.statistics, count=500)
    assert inferred.draws.shape == (500, 3) and inferred.p_value > 0.01
    assert np.all(np.abs(inferred.estimate - inferred.draws.mean(0)) < 4 * inferred.draws.std(0) / np.sqrt(500) + 0.05)
    low, high = np.quantile(inferred.draws[:, 2], [0.005, 0.995])
    assert low < 0.5 < high
    series = np.array([granular_infer.pour(height_m=height, seed=2).statistics for height in granular_infer.SERIES_M])
    by_three = granular_infer.infer(series, count=4000)
    assert series.shape == (3, 16) and by_three.draws.shape == (4000, 3) and by_three.p_value > 0.01
    one = granular_infer.infer(poured.statistics, count=4000)
    assert by_three.draws[:, 2].std() < 0.9 * one.draws[:, 2].std()
    assert granular_infer.infer(series, any_cloth=True).draws[:, 2].std() > by_three.draws[:, 2].std()
    with pytest.raises(errors.ChapterError, match="any_cloth is learned from 3 heaps"):
        granular_infer.infer(poured.statistics, any_cloth=True)
    with pytest.raises(errors.ArrayError, match=r"shape \(16, 3\), expected \(16,\) or \(3, 16\)"):
        granular_infer.infer(series.T)
    with pytest.raises(errors.ChapterError, match="15 statistics, expected 16, or 3 times 16"):
        granular_infer.infer(poured.statistics[:15])
    with pytest.raises(errors.ChapterError):
        granular_infer.pour(restitution=2.0)


def test_sbi_users_find_their_conventions():
    """A shape of draws, a simulator of theta alone, keywords of sbi."""
    prior = BoxUniform(low=[0.0, 1.0], high=[1.0, 2.0])
    assert prior.sample((5,)).shape == (5, 2) and prior.sample().shape == (2,) and prior.sample((3, 4)).shape == (3, 4, 2)
    assert np.allclose(prior.log_prob(prior.sample((5,))), 0.0) and prior.log_prob([[2.0, 1.5]])[0] == -np.inf
    theta, x = simulate_for_sbi(lambda theta: theta.sum(), proposal=prior, num_simulations=80, seed=1)
    assert x.shape == (80, 1) and np.allclose(x[:, 0], theta.sum(1))
    inference = NPE(prior=prior, density_estimator="mdn")
    posterior = inference.append_simulations(theta, x).train(max_num_epochs=5).build_posterior()
    assert posterior.sample((3, 4), x=[2.0]).shape == (3, 4, 2)
    assert posterior.set_default_x([2.0]).log_prob(theta).shape == (80,)
    with pytest.raises(errors.PosteriorError, match="no observation"):
        posterior.sample((5,))
    with pytest.raises(errors.PosteriorError, match="expected one number of them"):
        simulate_for_sbi(lambda theta: np.zeros(1 + (theta[0] > 0.5)), prior, 20)
