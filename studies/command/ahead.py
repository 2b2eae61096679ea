"""Compiles kernels that most studies need, in a process parallel to the process that reads and prepares a study."""

import gc
import os
import sys
import threading

import numpy as np
import xarray as xr

from ...fragility import fit_fragility
from ...models.runs import compile_lanes


def compile_ahead() -> None:
    """Compile the largest driver of the engine, then the fits of curves, and store them."""
    gc.disable()
    end_with_parent()
    compile_lanes()
    levels = np.arange(1.0, 9.0)
    fit_fragility(
        xr.Dataset({"overturned": (("level", "motion"), levels[:, None] > levels)}, {"level": levels}), replicates=2
    )


def end_with_parent() -> None:
    """End this process as soon as the one that has started it, and holds its input open, has ended."""
    threading.Thread(target=lambda: os._exit(len(sys.stdin.read())), daemon=True).start()
