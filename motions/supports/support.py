"""Benches and other elastic supports of one degree of freedom, under the motion of their floor."""

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np
import xarray as xr

from ...core.aliases import Array
from ...core.doubts import warn
from ...core.parameters import RATIO, Parameter, check
from ..kernels.oscillators import oscillator_history
from ..plausibility import unusual
from .chain import Motion, chained, one_way_only

Damping = Annotated[float, RATIO]
OneWay = Annotated[bool, Parameter()]
MassRatio = Annotated[float, RATIO]


@dataclass(frozen=True)
class Support:
    """Elastic support of one degree of freedom: a bench, a table, a rack; or a linear isolator (`Isolator.linear`).

    Parameters
    ----------
    frequency : float
        Natural frequency, Hz.
    damping : float
        Damping ratio.
    mass_ratio : float
        Mass of the load over the mass of load and support. The block's reaction on the support is left out, which is
        valid for a light block: a ratio above 0.1 (assumed) is an error unless `one_way` is True.
    one_way : bool
        True to leave out the reaction of heavier blocks, too.

    Notes
    -----
    The equation is u'' + 2 zeta omega u' + omega² u = -a under the acceleration a of its floor, which is linear between
    samples. The motion on top is a + u'' = -2 zeta omega u' - omega² u, exact at every sample.

    Examples
    --------
    >>> from toppling import motions
    >>> floor = motions.CloughPenzien(duration=5.0, dt=0.01).sample(2)
    >>> bench = Support(frequency=12.0, damping=0.03)
    >>> dict(bench.motions(floor).sizes)
    {'motion': 2, 'time': 2624}
    """

    frequency: Annotated[float, Parameter("Hz", at_least=0.01, at_most=1000.0)]
    damping: Damping = 0.05
    mass_ratio: MassRatio = 0.0
    one_way: OneWay = False

    def __post_init__(self) -> None:
        check(self)
        one_way_only(self.mass_ratio, self.one_way)
        warn(unusual({"frequency of a bench": self.frequency, "damping of a bench": self.damping}))

    def motions(self, motions: xr.DataArray) -> xr.DataArray:
        """Return the motions on top of the support.

        Parameters
        ----------
        motions : xarray.DataArray
            Absolute accelerations of the ground (motion, time) or of floors (motion, floor, time), m s-2, from rest.

        Returns
        -------
        xarray.DataArray
            As given, with ``support_displacement`` (m), the maximum relative to the floor at the samples, on motion
            (and floor). The support is elastic: scaling its motions is the same as scaling the motions below.

        Raises
        ------
        TypeError, ValueError
            As `toppling.motions.records`; pairs of components, a vertical component.
        """
        return chained(motions, self.on_top, repr(self), 1, 1.0, level=False)

    def on_top(self, acceleration: Array, dt: float) -> Motion:
        """Return the motion on top of the support under the acceleration (time,), m/s², of its floor."""
        omega = 2.0 * math.pi * self.frequency
        u, v = history = np.empty((2, acceleration.size))
        oscillator_history(acceleration, dt, omega, self.damping, history)
        return Motion(-2.0 * self.damping * omega * v - omega * omega * u, float(np.abs(u).max()))
