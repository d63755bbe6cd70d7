"""Folders and arrays."""

import json
import pickle
import subprocess

import numpy as np
import pytest

import missing_physics as mp
from conftest import falls
from missing_physics import errors


def test_a_folder_has_the_bytes_of_the_command(command, recordings, tmp_path):
    for name in ("dropped-ball", "steel-ball"):
        path = tmp_path / "answer.json"
        folder = f"recordings/{name}"
        subprocess.run([command, "--quiet", "diagnose", folder, "--json", path], cwd=recordings.parent, check=True)
        with pytest.MonkeyPatch.context() as patch:
            patch.chdir(recordings.parent)
            assert mp.diagnose(folder).json() == path.read_text(encoding="utf-8")


def test_arrays_say_what_the_folder_of_the_same_numbers_says(tmp_path):
    runs = falls()
    lines = ["run,t_s,z_m"]
    for label, run in enumerate(runs, 1):
        lines += [f"{label},{t!r},{z!r}" for t, z in zip(run["t_s"].tolist(), run["z_m"].tolist())]
    (tmp_path / "data.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    header = 'format = 1\ndomain = "trajectory"\ndata = "data.csv"\n[rig]\nmass_kg = 0.058\n'
    (tmp_path / "recording.toml").write_text(header, encoding="utf-8")
    of_folder = mp.diagnose(tmp_path).answer
    of_arrays = mp.diagnose(domain="trajectory", runs=runs, rig={"mass_kg": 0.058}).answer
    for answer in (of_folder, of_arrays):
        del answer["recording"], answer["provenance"]
    assert of_arrays == of_folder
    assert of_arrays["chosen"] == ["quadratic-drag"]


@pytest.fixture(scope="module")
def answer():
    return mp.diagnose(domain="trajectory", runs=falls())


def test_a_diagnosis_says_what_was_hidden(answer):
    assert (answer.verdict, answer.chosen) == ("explained", ["quadratic-drag"])
    drag = answer.parameters["k_per_m"]
    assert drag.ci95[0] < 0.02 < drag.ci95[1] and drag.unit == "1/m"
    assert answer.p_value < 0.05
    assert mp.diagnose(domain="trajectory", runs=falls(drag_per_m=0.0)).verdict == "adequate"


def test_a_diagnosis_pickles_and_shows_itself(answer, tmp_path):
    again = pickle.loads(pickle.dumps(answer))
    assert again == answer and again.html() == answer.html()
    assert again.repaired().predict(falls()[0])["z_m"] == pytest.approx(answer.repaired().predict(falls()[0])["z_m"])
    assert answer.html(tmp_path / "report.html") == (tmp_path / "report.html").read_text(encoding="utf-8")
    assert answer._repr_html_().startswith("<iframe srcdoc=") and "quadratic" in repr(answer)
    assert json.loads(answer.json())["verdict"] == "explained"


def test_data_frames(answer):
    pandas = pytest.importorskip("pandas")
    frame = answer.to_dataframe()
    assert frame.loc[frame.chosen, "parameter"].tolist() == ["k_per_m"]
    curves = answer.curves_to_dataframe()
    assert {"run", "t_s", "z_m", "before_z_m", "after_z_m"} == set(curves.columns)
    error = lambda name: float(np.sqrt(np.mean((curves.z_m - curves[name]) ** 2)))
    assert error("after_z_m") < 0.005 < error("before_z_m")
    parts = [pandas.DataFrame({"run": str(at + 1), **run}) for at, run in enumerate(falls())]
    assert mp.diagnose(domain="trajectory", runs=pandas.concat(parts)).json() == answer.json()


def test_a_repaired_model_predicts_what_was_not_measured(answer, tmp_path):
    unseen = falls(runs=4, sigma_m=0.0, seed=7)[3]
    begun = unseen["z_m"].copy()
    begun[15:] = np.nan
    predicted = answer.repaired().predict({"t_s": unseen["t_s"], "z_m": begun})
    assert np.abs(predicted["z_m"] - unseen["z_m"]).max() < 0.03
    assert np.all(predicted.low95["z_m"] < unseen["z_m"]) and np.all(unseen["z_m"] < predicted.high95["z_m"])
    answer.repaired().save(tmp_path / "model.json")
    assert mp.Repaired.load(tmp_path / "model.json") == answer.repaired()
    assert answer.repaired().mechanisms == ["quadratic-drag"] and answer.repaired().caveat is None
    with pytest.raises(errors.RepairError, match="give it a folder"):
        mp.Repaired.load(tmp_path / "model.json").predict(unseen)


def refused(change, kind, match, **arguments):
    runs = falls()
    change(runs)
    with pytest.raises(kind, match=match):
        mp.diagnose(domain="trajectory", runs=runs, **arguments)


def test_wrong_arrays_are_refused_in_words():
    def put(name, values, run=1):
        return lambda runs: runs[run].__setitem__(name, values)

    refused(put("z_m", np.zeros((48, 2))), errors.ArrayError, r'runs\[1\]\["z_m"\] has the shape \(48, 2\), expected \(48,\)')
    refused(put("z_m", np.zeros(47)), errors.ArrayError, r'runs\[1\]\["z_m"\] has 47 rows, expected 48')
    refused(put("z_m", np.zeros(48, complex)), errors.ArrayError, r"holds complex128, expected numbers")
    refused(put("z_m", [None] * 47 + ["a"]), errors.ArrayError, r"holds object, expected numbers")
    refused(put("z_m", np.full(48, np.nan)), errors.RecordingError, r'runs\[1\]\["z_m"\] is nan at row 0')
    refused(put("t_s", np.zeros(48), run=2), errors.RecordingError, r"runs\[2\], row 1, column t_s: 0, expected more than 0")
    refused(put("zz_m", np.zeros(48), run=0), errors.RecordingError, r"runs\[1\] has not the column zz_m")
    refused(put("zz_m", np.zeros(48)), errors.RecordingError, r"runs\[1\] has the column zz_m, runs\[0\] has not")
    refused(lambda runs: None, errors.RecordingError, r"unknown key rig.mass", rig={"mass": 1.0})
    refused(lambda runs: None, errors.DiagnosisError, r"alpha is 0.7", alpha=0.7)
    with pytest.raises(errors.RecordingError, match="expected one of: trajectory"):
        mp.diagnose(domain="flight", runs=falls())
    with pytest.raises(errors.RecordingError, match="no such file"):
        mp.diagnose("nowhere")
    with pytest.raises(errors.ArrayError, match=r"runs\[0\] is a ndarray, expected columns by name"):
        mp.diagnose(domain="trajectory", runs=[np.zeros(3)])


def test_every_kind_of_number_is_a_column():
    runs = falls()
    said = mp.diagnose(domain="trajectory", runs=runs).json()
    strided = [{name: np.repeat(values, 2)[::2] for name, values in run.items()} for run in runs]
    lists = [{name: values.tolist() for name, values in run.items()} for run in runs]
    assert mp.diagnose(domain="trajectory", runs=strided).json() == said
    assert mp.diagnose(domain="trajectory", runs=lists).json() == said
    single = [{name: values.astype(np.float32) for name, values in run.items()} for run in runs]
    assert mp.diagnose(domain="trajectory", runs=single).chosen == ["quadratic-drag"]


def test_progress_is_told_and_stops():
    told = []
    mp.diagnose(domain="trajectory", runs=falls(), progress=lambda stage, done: told.append((stage, done)))
    assert told[-1] == ("done", 1.0) and all(0 <= done <= 1 for _, done in told)

    def stop(stage, done):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        mp.diagnose(domain="trajectory", runs=falls(), progress=stop)


def test_a_bar_shows_progress(capsys):
    pytest.importorskip("tqdm")
    mp.diagnose(domain="trajectory", runs=falls(), progress=True)
    assert "100 %" in capsys.readouterr().err


def test_a_program_is_started_only_where_that_is_allowed(tmp_path):
    header = 'format = 1\ndomain = "custom"\ndata = "data.csv"\n[simulator]\ncommand = ["touch", "started"]\n'
    (tmp_path / "recording.toml").write_text(header, encoding="utf-8")
    with pytest.raises(errors.DiagnosisError, match="starts the program touch started"):
        mp.diagnose(tmp_path)
    assert not (tmp_path / "started").exists()


def test_domains_are_listed():
    listed = {domain["id"]: domain for domain in mp.domains()}
    assert "quadratic-drag" in [mechanism["id"] for mechanism in listed["trajectory"]["mechanisms"]]
    assert {"bounce", "custom", "dough-roll", "grain-pour", "indentation", "liquid-tilt", "slosh"} < set(listed)


def test_a_million_rows_are_held_a_few_times_over():
    """Columns of 16 MB are read within 15 times their size: a table of text would take that for itself."""
    import resource

    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    rows = 1_000_000
    run = {"t_s": np.arange(rows) * 1e-6, "z_m": np.zeros(rows)}
    run["t_s"][-1] = 0.0
    with pytest.raises(errors.RecordingError, match="row 999999, column t_s"):
        mp.diagnose(domain="trajectory", runs=[run])
    grown_mb = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024
    assert grown_mb < 15 * 16, f"{grown_mb:.0f} MB"
