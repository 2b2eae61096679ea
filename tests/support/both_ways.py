"""Values of a script, compiled and as plain Python."""

import json
import os
import subprocess
import sys


def both_ways(code):
    """Return what a script prints as JSON in a process with the compiler, and in one without."""
    found = []
    for switch in ("0", "1"):
        environment = {**os.environ, "NUMBA_DISABLE_JIT": switch}
        done = subprocess.run(
            [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True, cwd="/"
        )
        found.append(json.loads(done.stdout))
    return found
