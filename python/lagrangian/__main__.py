"""The command ``lagrangian``, also as ``python -m lagrangian``."""

from __future__ import annotations

import os
import signal
import sys
from typing import NoReturn

from . import _lagrangian
from .pixels import _command


def main() -> NoReturn:
    """Runs the command of ``sys.argv`` as a program of its own: its exit codes, and its end at Ctrl-C, are those of the program."""
    # A file must not take the place of a standard stream that is closed.
    while (place := os.open(os.devnull, os.O_RDWR)) <= 2:
        pass
    os.close(place)
    arguments = sys.argv[1:]
    if _command.takes(arguments):
        sys.exit(_command.main(arguments))
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    sys.exit(_lagrangian.command(arguments))


if __name__ == "__main__":
    main()
