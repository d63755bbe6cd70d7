"""Types: the stubs are those of the compiled part, and the package is sound by mypy."""

import subprocess
import sys
from pathlib import Path

import pytest

import missing_physics

PACKAGE = Path(missing_physics.__file__).parent


def run(*arguments):
    pytest.importorskip("mypy")
    done = subprocess.run([sys.executable, "-m", *arguments], capture_output=True, text=True, cwd=PACKAGE.parent)
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_package_is_typed():
    assert (PACKAGE / "py.typed").exists()
    run("mypy", "--strict", "--no-incremental", "--cache-dir=/dev/null", "--disable-error-code=import-untyped", "-p", "missing_physics")


def test_the_stubs_are_those_of_the_module():
    run("mypy.stubtest", "missing_physics._engine")
