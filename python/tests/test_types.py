"""Types: the stubs are those of the compiled part, and the package is sound by mypy."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import missing_physics

PACKAGE = Path(missing_physics.__file__).parent


def run(folder, *arguments):
    """Runs a checker on a copy of the package: beside the installed one stand other packages, which it would take for its own work."""
    pytest.importorskip("mypy")
    shutil.copytree(PACKAGE, folder / "missing_physics")
    environment = {**os.environ, "MYPYPATH": str(folder)}
    command = [sys.executable, "-m", *arguments]
    done = subprocess.run(command, capture_output=True, text=True, cwd=folder, env=environment)
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_package_is_typed(tmp_path):
    assert (PACKAGE / "py.typed").exists()
    run(tmp_path, "mypy", "--strict", "--no-incremental", "--cache-dir=/dev/null", "--disable-error-code=import-untyped", "-p", "missing_physics")


def test_the_stubs_are_those_of_the_module(tmp_path):
    # What pandas and tqdm are without their own stubs is not looked at here.
    (tmp_path / "mypy.ini").write_text("[mypy]\ndisable_error_code = import-untyped\n", encoding="utf-8")
    run(tmp_path, "mypy.stubtest", "--mypy-config-file", "mypy.ini", "missing_physics._engine")
