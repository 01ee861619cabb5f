"""The command of the package ends as the program does: exit codes, Ctrl-C, and standard output that is closed."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

COMMAND = [sys.executable, "-m", "lagrangian"]


def run(*words: str | bytes, **options: Any) -> subprocess.CompletedProcess[str]:
    return subprocess.run([*COMMAND, *words], capture_output=True, text=True, **options)


def test_the_exit_code_tells_success_failure_and_mistake(tmp_path: Path) -> None:
    assert run("--version").returncode == 0 and run("--help").stdout.startswith("Learns")
    (tmp_path / "still.csv").write_text("t,q1\n0,0\n1,0\n1,0\n")
    assert run("check", "still.csv", cwd=tmp_path).returncode == 1
    missing = run("check", "none.csv", cwd=tmp_path)
    assert missing.returncode == 2 and missing.stderr.startswith("error: ") and "hint: " in missing.stderr
    assert run("chekc").returncode == 2 and run().returncode == 2


def test_arguments_and_results_are_those_of_the_program(command: str, tmp_path: Path) -> None:
    words = ["simulate", "pendulum", "--duration", "1"]
    own, program = (subprocess.run([*first, *words], capture_output=True) for first in (COMMAND, [command]))
    assert own.stdout == program.stdout and own.stdout.count(b"\n") > 50
    for words in (["--help"], ["--version"], ["fit", "--help"], ["fit"], ["check", "a b.csv"]):
        own, program = (subprocess.run([*first, *words], capture_output=True, cwd=tmp_path) for first in (COMMAND, [command]))
        assert (own.returncode, own.stdout, own.stderr) == (program.returncode, program.stdout, program.stderr)


@pytest.mark.skipif(os.name != "posix", reason="file names are text elsewhere")
def test_an_argument_that_is_no_text_is_refused() -> None:
    refused = run("check", b"\xff.csv")
    assert refused.returncode == 2 and "not UTF-8" in refused.stderr


@pytest.mark.skipif(os.name != "posix", reason="there are no signals elsewhere")
@pytest.mark.parametrize("words", [["fit", "motion.csv", "--model", "lnn", "--seconds", "60", "--out", "run"], ["demo", "--seconds", "60"]])
def test_ctrl_c_ends_a_fit_with_the_code_of_an_interrupted_program(words: list[str], tmp_path: Path) -> None:
    made = run("simulate", "pendulum", "--trajectories", "5", "--out", "motion.csv", cwd=tmp_path)
    assert made.returncode == 0, made.stderr
    process = subprocess.Popen([*COMMAND, *words], cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    time.sleep(3.0)
    assert process.poll() is None
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 130 and "Traceback" not in errors, errors


@pytest.mark.skipif(os.name != "posix", reason="there are no signals elsewhere")
def test_a_standard_output_that_is_closed_is_the_end(tmp_path: Path) -> None:
    words = ["simulate", "pendulum", "--duration", "1000"]
    process = subprocess.Popen([*COMMAND, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    assert process.stdout is not None and process.stderr is not None
    process.stdout.readline()
    process.stdout.close()
    errors = process.stderr.read()
    assert process.wait(timeout=60) == 141 and not errors
    process.stderr.close()
    without = ["sh", "-c", 'exec "$@" >&-', "sh", *COMMAND, "simulate", "pendulum"]
    none = subprocess.run(without, stderr=subprocess.PIPE, text=True, timeout=60)
    assert none.returncode == 2 and "standard output is closed" in none.stderr
