"""Where things are, and recordings that are made here with numpy alone: nothing of the package makes its own test data."""

import os
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
GRAVITY_M_S2 = 9.80665


def pytest_addoption(parser):
    parser.addoption("--long", action="store_true", help="run what takes minutes, and Dask")


def pytest_collection_modifyitems(config, items):
    if config.getoption("--long"):
        return
    for item in items:
        if "long" in item.keywords:
            item.add_marker(pytest.mark.skip(reason="long: .ci/python --long"))


@pytest.fixture
def recordings():
    return ROOT / "recordings"


@pytest.fixture
def command():
    """The compiled command, which `.ci/python` names."""
    command = os.environ.get("MISSING_PHYSICS_COMMAND")
    if not command:
        pytest.skip("MISSING_PHYSICS_COMMAND names no command to compare with")
    return command


def falls(drag_per_m=0.02, runs=3, sigma_m=0.004, seed=1):
    """Drops with drag quadratic in the speed, in closed form: v = v_t tanh(g t / v_t), z = z0 - v_t^2/g ln cosh(g t / v_t)."""
    rng = np.random.default_rng(seed)
    made = []
    for run in range(runs):
        t_s = np.arange(0.0, 1.6, 1 / 30)
        height_m = 12.0 + run
        fallen = 0.5 * GRAVITY_M_S2 * t_s**2
        if drag_per_m > 0:
            fallen = np.log(np.cosh(t_s * np.sqrt(GRAVITY_M_S2 * drag_per_m))) / drag_per_m
        made.append({"t_s": t_s, "z_m": height_m - fallen + sigma_m * rng.standard_normal(t_s.size)})
    return made


def decays(rate_per_s=0.4, offset=0.0, runs=3, sigma=0.003, seed=2):
    """What a simulator of one's own is asked of: a charge that leaks from 1, and an offset that a sensor may have."""
    rng = np.random.default_rng(seed)
    t_s = np.linspace(0.0, 5.0, 60)
    clean = [np.exp(-rate_per_s * t_s) * (1 + 0.3 * run) + offset for run in range(runs)]
    return [
        {"t_s": t_s, "size_v": np.full(t_s.size, 1 + 0.3 * run), "charge_v": each + sigma * rng.standard_normal(t_s.size)}
        for run, each in enumerate(clean)
    ]
