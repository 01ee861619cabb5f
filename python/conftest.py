"""Modules that need PyTorch are left out where it is missing, which is said."""

from __future__ import annotations

from importlib.util import find_spec

HAS_TORCH = find_spec("torch") is not None

collect_ignore = [] if HAS_TORCH else ["lagrangian/torch.py", "tests/test_torch.py"]


def pytest_report_header() -> str | None:
    if HAS_TORCH:
        return None
    return (
        "not run: lagrangian/torch.py and tests/test_torch.py, as PyTorch is missing. "
        "Install it in this environment (pip install torch), or name one that has it in PYTHONPATH"
    )
