"""How a peer takes part: requests are lines of JSON on standard input, answers on standard output.

    {"task": {"name": "lnn-step", "file": "…", …}}   →   {"ready": {"compile_ms": …, "check": [loss, loss, …]}}
    {"laps": k}                                      →   {"ms": of one of k iterations, on average}
    "end"                                            →   (nothing; the next task may come)

What cannot be done is answered by {"error": "why"}.
"""

import json
import sys
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial


@dataclass
class Entry:
    """A task that is ready to be timed: `run(k)` does k iterations and returns when they are done."""

    compile_ms: float
    check: list
    run: Callable[[int], None]


def milliseconds(call):
    """What `call` returns, and the time that it took."""
    start = time.perf_counter()
    found = call()
    return found, 1e3 * (time.perf_counter() - start)


def answer(reply):
    print(json.dumps(reply), flush=True)


def serve(tasks):
    """Answers requests until the end of the input."""
    entry = None
    for line in sys.stdin:
        request = json.loads(line)
        try:
            if request == "end":
                entry = None
            elif "task" in request:
                task = request["task"]
                entry = tasks[task["name"]](task, read(task))
                answer({"ready": {"compile_ms": entry.compile_ms, "check": entry.check}})
            else:
                laps = request["laps"]
                _, time_ms = milliseconds(partial(entry.run, laps))
                answer({"ms": time_ms / laps})
        except Exception as error:
            traceback.print_exc()
            answer({"error": f"{type(error).__name__}: {error}"})


def read(task):
    """The data that the task names."""
    with open(task["file"]) as file:
        return json.load(file)
