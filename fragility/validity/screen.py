"""Validity screen: reasons, for every run, why rocking may not be the right model of it."""

import json
from collections.abc import Mapping

import numpy as np
import xarray as xr

from ...core import checks
from ...core.aliases import Progress
from ...core.parameters import HALF_INTERVAL, SHARE
from ...models.friction import Contact, Friction
from ...models.sliding.law import SlidingLaw
from ...motions.arrays import listed
from ...motions.simulated.generator import Generator
from ..runs.provenance import BED, RUN, Motions, provenance_from, records_of
from ..runs.request import runner_of
from ..runs.runners import Workers
from .characteristics import Characteristics
from .reasons import reason_names
from .slab_screen import DIMS, FACTORS, HALF_WIDTH, Screened, ScreenRequest, screen_input, screened_runs
from .sparse_screen import NUMBERS, OF_RUNS, selected, shaken_by, sparse_screen
from .undecided import FlipCounts, count_flips


def screen(
    runs: xr.Dataset,
    motions: Motions | Generator | None = None,
    friction: float | Friction | Contact | Mapping[str, float | Friction | Contact] | None = None,
    *,
    factors: tuple[float, float] = FACTORS,
    half_width: float = HALF_WIDTH,
    undecided: bool | float = False,
    client: Workers = None,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Screen runs for conditions under which rocking is not the right model.

    Parameters
    ----------
    runs : xarray.Dataset
        As `toppling.ida` (or `stripes`, or `cloud`) returns it.
    motions : xarray.DataArray or a sequence of them, or Generator, optional
        The motions of the runs (for stripes, one set for each stripe; at adaptive levels also the generator, which
        makes them again).  Without them neither the friction at uplift nor the frequency bands of the motions can be
        assessed.
    friction : float, Friction, Contact or mapping, optional
        Coefficient of friction between block and floor: a number, a distribution or a `Contact`
        (`toppling.models.friction`), or any of them for each block by its label. Only the static friction of a
        `Contact` counts. If not given, only a need above 1 counts as sliding.
    factors : (float, float)
        Minimum and maximum scale factor that pass, for motions that have an amplitude of their own (records,
        scenarios).
    half_width : float
        Maximum half width of the 95 % interval of a probability of 1/2 that passes.
    undecided : bool or float
        True, or the share of the motions, for which flags are tested: up to four more runs for each, with scale
        factors, and e, times 1 ± 1e-6.  At adaptive levels these motions are evenly spaced, from the first one on.
    client, progress
        For these additional runs, as for `toppling.ida`.

    Returns
    -------
    xarray.Dataset
        Each variable is on the dimensions that it depends on. At adaptive levels, variables on level and motion below
        are on run, with ``run_block``, ``run_model``, ``run_motion``; the runs are of the blocks, laws and motions in
        `runs`.

        - ``friction_uplift`` (block): b/h, needed at uplift; ``friction_impact`` (block, model): needed at impact;
        - ``friction_uplift_demand`` (block, level, motion): needed up to the peak of the half-cycle that lifts the
          block, or by the peak of the motion if it does not uplift;
        - ``friction_rocking_demand`` (block, level, motion): needed by the peak of the motion while the block is nearly
          upright;
        - ``slides`` (block, model, level, motion), with friction given: the probability that it is below the maximum of
          these, or a flag for a known friction;
        - ``squat`` (block); ``elastic_frequency`` (block, model), Hz, of laws with an elastic zone at rest;
          ``band_low`` and ``band_high`` (motion), Hz;
        - ``scale_factor`` (level, motion), with block if it depends on it;
        - ``few_motions`` and ``interval_half_width``, of the floor or stripe with the fewest motions;
        - ``verdict`` (block, model, level, motion): 0 if there is no reason against a run, else the sum of its reasons
          (`REASONS`; attributes flag_masks and flag_meanings);
        - ``outside`` (block, model, reason): share of the runs with each reason, for `any` with at least one reason,
          for `undecided` among the runs tested;
        - if runs were tested: ``perturbed`` (motion), True for the motions tested; ``undecided`` (block, model), the
          share of flags that change. Its 95 % Wilson interval is ``undecided_lower`` and ``undecided_upper``. At
          adaptive levels ``undecided_tested`` (block, model) is their number.

    Notes
    -----
    If the motions have a vertical component, a run in which the floor falls faster than g is ``airborne``. The block
    leaves the floor, the run is not computed, and it counts as overturned. A missing vertical component cannot be
    screened, and does not enter the friction that runs need.

    The peak of the half-cycle that lifts the block occurs when the block has hardly rotated: in that half-cycle its
    exact motion needs 0.98 to 1 of `friction_uplift_demand`. The peak of the motion may occur at any time. Over whole
    histories of blocks with h/b >= 3, up to four times g b/h, the need is 0.68 to 1.02 of `friction_rocking_demand` (60
    simulated motions). Squat blocks may lose all pressure on the floor, for which no friction compensates: they are
    `squat`. Sliding counts if its probability is above one half; while rocking and at impact only for motions that
    exceed g b/h.

    The band of a motion contains the middle 90 % of its energy by frequency (`motions.spectra.energy_band`). A block
    whose elastic mode lies inside the band resonates, and uplifts although it should not. The mode of a soft support
    (``rest="soft"``) or of a soft bed is physical and no reason.

    At n motions the Wilson interval of 1/2 has a half width of z/(2 sqrt(n + z²)).

    References
    ----------
    `friction_at_uplift`, `friction_at_impact`.  Lipscombe, P. R. and Pellegrino, S. (1993). Free rocking of prismatic
    blocks. Journal of Engineering Mechanics 119(7), 1387-1410.  Davalos, H. and Miranda, E. (2019). Evaluation of the
    scaling factor bias influence on the probability of collapse using Sa(T1) as the intensity measure. Earthquake
    Spectra 35(2).

    Examples
    --------
    >>> import toppling as tp
    >>> shakes = tp.motions.CloughPenzien(duration=10.0, dt=0.01).sample(4)
    >>> runs = tp.ida(tp.catalogue["file-vertical-2-drawer"], tp.HousnerImpact(), shakes, [2.0, 9.8])
    >>> screened = screen(runs, shakes, friction=0.5)
    >>> round(float(screened["friction_uplift"][0]), 3), bool(screened["squat"][0])
    (0.625, True)
    >>> screened["verdict"].values[0, 0, :, 0].tolist()  # squat; at 1 g it slides, too
    [1, 7]
    """
    try:
        least, greatest = factors
    except (TypeError, ValueError):
        raise ValueError(f"factors must be a least and a greatest one, got {factors!r}") from None
    lowest, highest = (checks.number("factors", factor, above=0.0) for factor in (least, greatest))
    if lowest >= highest:
        raise ValueError(f"factors must be a least and a greatest one, got {lowest:g} and {highest:g}")
    widest = HALF_INTERVAL.number("half_width", half_width)
    share = float(undecided) if isinstance(undecided, bool | np.bool_) else SHARE.number("undecided", undecided)
    if motions is None and share > 0.0:
        raise ValueError("motions must be given where undecided runs are looked for: they are run again")
    checks.callback("progress", progress)
    asked = ScreenRequest(friction, (lowest, highest), widest, share)
    runner = runner_of(client)
    if isinstance(runs, xr.Dataset):
        # results of `slide_runs` have no law, only the name of its model
        checks.not_empty("runs", runs)
        laws = runs.coords.get("law", runs.coords.get("model"))
        if laws is not None and bool((laws == SlidingLaw.law).any()):
            raise ValueError("runs must be of rocking blocks, got some of sliding ones")
    if isinstance(runs, xr.Dataset) and RUN in runs.dims:
        runs = selected(runs)
        shaken = None if motions is None else shaken_by(runs, motions, share)
        variables, settings = sparse_screen(runs, shaken, asked, runner, progress)
        variables |= {name: runs[name].variable for name in (*OF_RUNS, "wave")}
    else:
        given = screen_input(runs)
        shaking: Characteristics | None = None
        flips: FlipCounts | None = None
        if isinstance(motions, Generator):
            raise TypeError("motions must be labelled arrays: a generator is for runs at adaptive levels alone")
        if motions is not None:
            every = motions if isinstance(motions, xr.DataArray) else listed(motions)
            shaking = Characteristics.of(records_of(runs, every))
            flips = count_flips(runs, every, share, runner, progress) if share > 0.0 else None
        variables, settings = screened_runs(given, shaking, asked, flips, runner.array)
    kept = [dim for dim in DIMS if dim in runs.coords]
    kept += [name for name in (BED, "round", *NUMBERS) if name in runs.coords]  # (for the notes)
    if (runs["rest"] == "soft").any():  # (likewise: they tell whose elastic mode is real)
        kept.append("rest")
    return xr.Dataset(
        variables,
        coords={name: runs[name].variable for name in kept} | {"reason": reason_names()},
        attrs={
            "title": "Validity screen",
            **provenance_from("validity screen", settings, runs=runs),
            "screen": json.dumps(settings, ensure_ascii=False),
        },
    )


def with_screen(runs: xr.Dataset, screened: Screened) -> xr.Dataset:
    """Add to runs the variables of their screen, and its settings."""
    variables, settings = screened
    text = json.dumps(settings, ensure_ascii=False)
    return runs.assign(variables).assign_coords(reason=reason_names()).assign_attrs(screen=text)
