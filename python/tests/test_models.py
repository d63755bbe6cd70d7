"""A simulator of one's own, and what it may do wrong."""

import os
import pickle
import signal
import threading

import numpy as np
import pytest

import missing_physics as mp
from conftest import decays
from missing_physics import errors

RATE = mp.Parameter("rate_per_s", start=0.3, lower=0.0, scale=0.1)
OFFSET = mp.Mechanism("sensor-offset", [mp.Parameter("offset_v", scale=0.05)], equation="charge + offset")


def leak(parameters, inputs):
    return {"charge_v": inputs["size_v"] * np.exp(-parameters["rate_per_s"] * inputs["t_s"]) + parameters["offset_v"]}


def leaks(parameters, inputs):
    """Many sets of parameters at once."""
    decay = np.exp(-np.outer(parameters["rate_per_s"], inputs["t_s"]))
    return {"charge_v": inputs["size_v"] * decay + parameters["offset_v"][:, None]}


def model(predict=leak, **more):
    return mp.Model(predict, parameters=[RATE], mechanisms=[OFFSET], **more)


def test_what_was_hidden_is_found():
    answer = mp.diagnose(model(), decays(offset=0.1))
    assert (answer.verdict, answer.chosen) == ("explained", ["sensor-offset"])
    low, high = answer.parameters["offset_v"].ci95
    assert low < 0.1 < high and answer.parameters["offset_v"].unit == "V"
    assert mp.diagnose(model(), decays()).verdict == "adequate"


def test_batches_and_arrays_alone_say_the_same():
    plain = mp.diagnose(model(), decays(offset=0.1))
    batched = mp.diagnose(model(leaks, batched=True, channels=["charge_v"]), decays(offset=0.1))
    alone = mp.diagnose(model(lambda p, x: leak(p, x)["charge_v"], channels=["charge_v"]), decays(offset=0.1))
    assert batched.parameters["offset_v"].value == pytest.approx(plain.parameters["offset_v"].value, rel=1e-9)
    assert alone.json() == plain.json()


def test_a_batched_model_is_asked_for_many_sets_at_once():
    sizes = []

    def counted(parameters, inputs):
        sizes.append(len(parameters["offset_v"]))
        return leaks(parameters, inputs)

    mp.diagnose(model(counted, batched=True, channels=["charge_v"]), decays(offset=0.1))
    assert max(sizes) >= 3


def test_the_repaired_model_predicts_by_the_function():
    answer = mp.diagnose(model(), decays(offset=0.1))
    unseen = decays(offset=0.1, runs=4, sigma=0.0)[3]
    predicted = answer.repaired().predict({"t_s": unseen["t_s"], "size_v": unseen["size_v"]})
    assert np.abs(predicted["charge_v"] - unseen["charge_v"]).max() < 0.01
    assert set(answer.repaired().parameters) >= {"rate_per_s", "offset_v"}


def test_a_diagnosis_of_a_model_pickles():
    answer = mp.diagnose(model(), decays(offset=0.1))
    again = pickle.loads(pickle.dumps(answer))
    unseen = {name: decays()[0][name] for name in ("t_s", "size_v")}
    assert np.array_equal(again.repaired().predict(unseen)["charge_v"], answer.repaired().predict(unseen)["charge_v"])
    local = mp.diagnose(model(lambda p, x: leak(p, x)), decays(offset=0.1))
    lost = pickle.loads(pickle.dumps(local))
    with pytest.raises(errors.RepairError, match="simulator"):
        lost.repaired().predict(unseen)
    assert np.allclose(lost.repaired(model()).predict(unseen)["charge_v"], answer.repaired().predict(unseen)["charge_v"])


def wrong(predict, kind, match, **more):
    with pytest.raises(kind, match=match):
        mp.diagnose(model(predict, channels=["charge_v"], **more), decays(offset=0.1))


def test_what_a_simulator_does_wrong_is_said():
    def raises(parameters, inputs):
        raise ZeroDivisionError("the tank is empty")

    def changes(parameters, inputs, state=np.random.default_rng(1)):
        return {"charge_v": leak(parameters, inputs)["charge_v"] + state.standard_normal()}

    def at(values):
        return lambda parameters, inputs: {"charge_v": values}

    wrong(raises, ZeroDivisionError, "the tank is empty")
    wrong(changes, errors.SimulatorError, "answered one question twice, with .* seed its random numbers")
    wrong(at(np.full(60, np.nan)), errors.SimulatorError, "no finite number for charge_v at row 0")
    wrong(at(np.zeros(59)), errors.SimulatorError, "59 values of charge_v, expected 60")
    wrong(at(np.zeros((60, 2))), errors.ArrayError, "charge_v has 2 dimensions, expected 1")
    wrong(at(["a"] * 60), ValueError, "could not convert string")
    wrong(lambda p, x: {"voltage": np.zeros(60)}, errors.SimulatorError, "voltage.*expected a dict with charge_v")
    wrong(lambda p, x: None, errors.MissingPhysicsError, "charge_v has 0 dimensions, expected 1|no finite number")
    wrong(lambda p, x: {"charge_v": np.zeros((1, 60))}, errors.SimulatorError, "1 rows of charge_v, expected", batched=True)


def test_a_model_without_mechanisms_or_parameters_is_judged():
    alone = mp.Model(lambda p, x: {"charge_v": leak({**p, "offset_v": 0.0}, x)["charge_v"]}, parameters=[RATE])
    assert mp.diagnose(alone, decays()).verdict == "adequate"
    fixed = mp.Model(lambda p, x: {"charge_v": leak({"rate_per_s": 0.4, "offset_v": 0.0}, x)["charge_v"]})
    assert mp.diagnose(fixed, decays()).verdict == "adequate"
    # What a sensor does is tried behind any simulator.
    assert mp.diagnose(fixed, decays(offset=0.3)).chosen == ["sensor-offset"]


def test_a_run_begins_where_it_was_measured():
    def fall(p, x):
        return {"z_m": p["z_m_at_start"] - 0.5 * p["g_m_s2"] * x["t_s"] ** 2}

    t_s, rng = np.linspace(0, 1, 40), np.random.default_rng(4)
    runs = [{"t_s": t_s, "z_m": height - 4.9 * t_s**2 + 1e-3 * rng.standard_normal(40)} for height in (900.0, 20.0)]
    gravity = mp.Parameter("g_m_s2", start=9.0, scale=1.0)
    for start in ("measured", [900.0, 20.0]):
        begun = mp.Parameter("z_m_at_start", start=start, scale=0.1, per_run=True)
        assert mp.diagnose(mp.Model(fall, parameters=[gravity, begun]), runs).verdict == "adequate"


def test_no_prediction_at_some_parameters_is_no_failure():
    def careful(parameters, inputs):
        if parameters["rate_per_s"] > 0.6:
            raise mp.NoPrediction("the rate is beyond the solver's")
        return leak(parameters, inputs)

    assert mp.diagnose(model(careful), decays(offset=0.1)).chosen == ["sensor-offset"]


def test_declarations_that_make_no_sense_are_refused():
    for change, match in [
        ({"parameters": [mp.Parameter("rate_per_s", start=-1.0, lower=0.0)]}, "mechanism|start"),
        ({"mechanisms": [mp.Mechanism("Not An Id", [mp.Parameter("offset_v")])]}, "lower case with hyphens"),
        ({"mechanisms": [mp.Mechanism("nothing", [])]}, "at least one"),
        ({"channels": ["volts"]}, "the channel volts is no column"),
    ]:
        arguments = {"parameters": [RATE], "mechanisms": [OFFSET], "channels": ["charge_v"], **change}
        with pytest.raises(errors.RecordingError, match=match):
            mp.diagnose(mp.Model(leak, **arguments), decays())
    with pytest.raises(errors.DiagnosisError, match="runs is missing"):
        mp.diagnose(model())


def test_an_interruption_stops_the_simulator():
    asked = threading.Event()

    def slow(parameters, inputs):
        if asked.is_set():
            threading.Event().wait(0.02)
        else:
            asked.set()
            threading.Timer(0.1, os.kill, (os.getpid(), signal.SIGINT)).start()
        return leak(parameters, inputs)

    # What a shell starts in the background ignores interruptions.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt):
            mp.diagnose(model(slow, channels=["charge_v"]), decays(offset=0.1))
    finally:
        signal.signal(signal.SIGINT, before)
