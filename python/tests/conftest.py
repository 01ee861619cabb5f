"""Data and models that several tests share."""

from __future__ import annotations

import builtins
import os
import shutil
import signal
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

import lagrangian as lg


@pytest.fixture(scope="session", autouse=True)
def heard() -> Iterator[None]:
    """Ctrl-C is heard, here and in programs that the tests start: a shell has what it starts in the background ignore it."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.fixture(scope="session")
def swings() -> lg.Trajectories:
    """Ten motions of a pendulum."""
    return lg.simulate("pendulum", trajectories=10, duration=4.0, step=0.02, length=0.5, seed=1)


@pytest.fixture(scope="session")
def lnn(swings: lg.Trajectories) -> lg.Estimator:
    """A Lagrangian network that was fitted to them."""
    return lg.Lnn(width=16, batch=64, steps=150, seed=3).fit(swings)


@pytest.fixture(scope="session")
def command() -> str:
    """The command, as `cargo xtask test` has built it."""
    path = os.environ.get("LAGRANGIAN_COMMAND") or shutil.which("lagrangian")
    if path is None or not Path(path).exists():
        message = "skipped: no command; build it and set LAGRANGIAN_COMMAND to its path"
        if os.environ.get("CI"):
            pytest.fail(message)
        pytest.skip(message)
    return path


@pytest.fixture
def without(monkeypatch: pytest.MonkeyPatch) -> Callable[[str], None]:
    """Makes a package as if it were not installed."""
    def forget(package: str) -> None:
        before = builtins.__import__

        def refuse(name: str, *rest: Any, **others: Any) -> Any:
            if name.split(".")[0] == package:
                raise ImportError(name)
            return before(name, *rest, **others)

        monkeypatch.setattr(builtins, "__import__", refuse)

    return forget
