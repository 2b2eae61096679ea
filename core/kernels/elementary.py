"""Compiled loops of elementary functions (`core.elementary`): the C library's, called value by value."""

import numpy as np

from ..compiled import kernel


@kernel(keep=True)
def fill(function, x, y, found):
    """Write a function of each x, or x and y, by its place in `elementary.PYTHON`, into `found`."""
    for i in range(x.size):
        if function == 0:
            found[i] = np.exp(x[i])
        elif function == 1:
            found[i] = np.log(x[i])
        elif function == 2:
            found[i] = np.expm1(x[i])
        elif function == 3:
            found[i] = np.log1p(x[i])
        elif function == 4:
            found[i] = np.tan(x[i])
        elif function == 5:
            found[i] = np.arcsin(x[i])
        elif function == 6:
            found[i] = np.arccos(x[i])
        elif function == 7:
            found[i] = np.arctan(x[i])
        elif function == 8:
            found[i] = np.power(x[i], y[i])
        else:
            found[i] = np.arctan2(x[i], y[i])
