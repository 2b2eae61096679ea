"""Compiled loops of elementary functions (`core.elementary`): the C library's, called value by value."""

import numpy as np

from ..compiled import kernel


@kernel(keep=True)
def fill(function, x, y, out):
    """Write a function of each x, or x and y, by its place in `elementary.PYTHON`, into `out`."""
    for i in range(x.size):
        if function == 0:
            out[i] = np.exp(x[i])
        elif function == 1:
            out[i] = np.log(x[i])
        elif function == 2:
            out[i] = np.expm1(x[i])
        elif function == 3:
            out[i] = np.log1p(x[i])
        elif function == 4:
            out[i] = np.tan(x[i])
        elif function == 5:
            out[i] = np.arcsin(x[i])
        elif function == 6:
            out[i] = np.arccos(x[i])
        elif function == 7:
            out[i] = np.arctan(x[i])
        elif function == 8:
            out[i] = np.power(x[i], y[i])
        else:
            out[i] = np.arctan2(x[i], y[i])
