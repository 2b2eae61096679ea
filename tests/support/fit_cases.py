"""Data that the tests of fits share."""

import math

import numpy as np
import xarray as xr
from scipy.optimize import minimize_scalar

# Baker (2015), and what 40 digits say of it: estimates, standard errors of ln(median) and dispersion
BAKER_LEVELS = np.array([0.2, 0.3, 0.4, 0.6, 0.7, 0.8, 0.9, 1.0])
BAKER_OVERTURNINGS = np.array([0, 0, 0, 4, 6, 13, 12, 16])
BAKER_MEDIAN, BAKER_DISPERSION = 1.0761157942926833, 0.4292372038323184


def counts(levels, overturnings, runs=40):
    runs = np.broadcast_to(runs, np.shape(overturnings))
    dims = (*(f"set{i}" for i in range(np.ndim(overturnings) - 1)), "level")
    return xr.Dataset(
        {"overturnings": (dims, np.array(overturnings)), "runs": (dims, np.array(runs))},
        coords={"level": ("level", np.array(levels, float), {"units": "m s-2", "im": "pga"})},
    )


BAKER = counts(BAKER_LEVELS, BAKER_OVERTURNINGS)


def capacities(rng, studies, motions, median=1.0, dispersion=0.4):
    """Capacities (study, motion)."""
    return median * np.exp(dispersion * rng.standard_normal((studies, motions)))


def clustered(seed, studies, motions, levels, median=1.0, dispersion=0.4, noise=0.0):
    """Incremental analyses (study, level, motion): each motion has one capacity; with noise it may stand above it.

    The curve is then lognormal with the dispersion sqrt(dispersion² + noise²).
    """
    rng = np.random.default_rng(seed)
    capacity = np.log(capacities(rng, studies, motions, median, dispersion))[:, None, :]
    scatter = noise * rng.standard_normal((studies, len(levels), motions)) if noise else 0.0
    return xr.Dataset(
        {"overturned": (("study", "level", "motion"), capacity + scatter <= np.log(levels)[:, None])},
        coords={
            "level": ("level", np.asarray(levels), {"units": "m s-2", "im": "pga"}),
            "motion": [f"motion {i + 1}" for i in range(motions)],
        },
    )


def once(seed, intensities, median=1.0, dispersion=0.4):
    """A cloud: every motion once."""
    rng = np.random.default_rng(seed)
    fell = capacities(rng, 1, intensities.size, median, dispersion)[0] <= intensities
    return xr.Dataset(
        {"overturned": ("motion", fell)},
        coords={
            "motion": [f"motion {i + 1}" for i in range(intensities.size)],
            "intensity": ("motion", intensities, {"units": "m s-1", "im": "pgv", "long_name": "peak floor velocity"}),
        },
        attrs={"design": "cloud"},
    )


def striped(seed, levels, motions, median=1.0, dispersion=0.4):
    """Stripes: other motions at each level."""
    runs = once(seed, np.repeat(levels, motions), median, dispersion)
    stripe = np.repeat(np.arange(1, len(levels) + 1), motions)
    return runs.assign_coords(stripe=("motion", stripe), record=("motion", runs["motion"].values)).assign_attrs(
        design="stripes"
    )


def objective(link, x, k, n, penalised=False, first=False):
    """Minus the (penalised) log-likelihood of (a, b), written with numpy from its definition."""

    def loss(a, b):
        p = link.cumulative(a + b * x)
        with np.errstate(divide="ignore", invalid="ignore"):
            if first:
                value = np.sum(k * np.log(np.diff(np.concatenate([[0.0], p, [1.0]])))) if b > 0 else -np.inf
            else:
                value = np.sum(np.where(k > 0, k * np.log(p), 0.0) + np.where(k < n, (n - k) * np.log1p(-p), 0.0))
            if penalised:
                step = 1e-5
                slope = (link.cumulative(a + b * x + step) - link.cumulative(a + b * x - step)) / (2.0 * step)
                weight = np.where((p > 0.0) & (p < 1.0), n * slope**2 / (p * (1.0 - p)), 0.0)
                s0, s1, s2 = (np.sum(weight * x**i) for i in range(3))
                value += 0.5 * np.log(s0 * s2 - s1**2)
        return -value if np.isfinite(value) else 1e10

    return loss


def profile(loss, link, p, at):
    """Least loss with ln x of the fractile p at `at`, or where p is None with ln(dispersion) there."""
    if p is None:
        b = link.scale / math.exp(at)
        found = minimize_scalar(lambda shift: loss(-b * shift, b), bracket=(-0.3, 0.3), tol=1e-13)
        return found.fun
    found = minimize_scalar(
        lambda log_b: loss(link.quantile(p) - math.exp(log_b) * at, math.exp(log_b)), bracket=(0.0, 1.5), tol=1e-13
    )
    return found.fun
