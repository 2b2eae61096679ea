"""Estimates from samples x motions of one uncertain block: curves of each sample and of all, rates, variance shares."""

import json
import warnings
from collections.abc import Sequence

import numpy as np
import xarray as xr

from ...core.aliases import Flags, Index, Progress
from ...core.units import DIMENSIONLESS, PER_YEAR
from ...core.wording import years_text
from ...fragility import capacity_variance_shares, fit_fragility, overturning_probability, variance_shares
from ...fragility.fitting.intervals import WALD
from ...fragility.hazard.poisson import probability_in
from ...fragility.numerics.slabs import gathered
from ...fragility.runs.factors import BlockFactors, Factors
from ...fragility.runs.runners import Runner
from ...fragility.runs.scaling import ground_of, scaling
from ...fragility.validity.characteristics import Characteristics
from ...fragility.validity.slab_screen import ScreenRequest
from ...fragility.validity.summary import input_of_pairs, over_samples, summary_screen
from ...fragility.validity.undecided import FlipCounts, choose_motions, count_flips_of, turned
from ...models import Block, Law
from ...models.laws import oscillator_of
from ...motions import records
from .designs import Incremental
from .estimates import Fit
from .risk import Risk


def screen_samples(
    block: Block,
    pairs: Sequence[Sequence[tuple[Block, Law]]],
    design: Incremental,
    overturned: xr.DataArray,
    asked: ScreenRequest,
    shaking: Characteristics,
    runner: Runner,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Screen all samples (sample, model) of one block together, as `summary_screen`; on block: the nominal one."""
    plain = records(design.motions)
    ground = ground_of(plain, records(design.ground)) if design.ground else None
    blocks = [row[0][0] for row in pairs]
    scaled = scaling(design.levels, plain, design.im, blocks, ground)
    given = input_of_pairs(
        [str(i) for i in range(len(pairs))],
        pairs,
        plain,
        scaled.factors_at(xr.Variable("level", scaled.levels), len(plain)),
    )
    flips, undecided = None, asked.undecided
    if undecided > 0.0:
        chosen = choose_motions(len(plain), undecided)
        flags = overturned.transpose("sample", "model", "level", "motion").values
        near = [pair for pair, is_in in zip(plain, chosen, strict=True) if is_in]
        counts = runner.array((*flags.shape[:3], len(near)), np.int8)
        done, every = 0, samples_perturbed_runs(pairs, design, undecided)
        for at in _alike(pairs):
            rows = [pairs[i] for i in at]

            def flags_of(part: slice, at: Index = at) -> Flags:
                of_part: Flags = flags[at[part]][..., chosen]
                return of_part

            def tell(n: int, _: int, done: int = done) -> None:
                if progress is not None:
                    progress(done + n, every)

            factors = _factors_of(scaled.factors, at, chosen)
            counts[at] = count_flips_of(rows, turned, near, flags_of, factors, runner, tell, design.about == 2)
            done += samples_perturbed_runs(rows, design, undecided)
        flips = FlipCounts(chosen, counts)
    return over_samples(summary_screen(given, shaking, asked.friction, flips), block)


def samples_perturbed_runs(pairs: Sequence[Sequence[tuple[Block, Law]]], design: Incremental, undecided: float) -> int:
    """Return the number of further runs that test which outcomes of a block's samples are undecided."""
    if undecided == 0.0:
        return 0
    chosen = int(choose_motions(design.shakes, undecided).sum())
    per_motion = sum(2 if law.restitution(block) is None else 4 for row in pairs for block, law in row)
    return per_motion * chosen * (design.runs // design.shakes) * design.about


def _alike(pairs: Sequence[Sequence[tuple[Block, Law]]]) -> list[Index]:
    """Return the positions of the samples in groups that have laws of the same kinds."""
    groups: dict[tuple[tuple[type[Law], bool], ...], list[int]] = {}
    for i, row in enumerate(pairs):
        groups.setdefault(tuple((type(law), oscillator_of(block, law).exact) for block, law in row), []).append(i)
    return [np.array(at) for at in groups.values()]


def _factors_of(factors: Factors, samples: Index, motions: Flags) -> Factors:
    """Return the factors of some samples, if each has its own, under some motions."""
    if isinstance(factors, BlockFactors):
        return factors._replace(measured=factors.measured[samples][:, motions])
    return (factors if factors.shape[0] == 1 else factors[samples])[:, :, motions]


def joined_screens(parts: Sequence[xr.Dataset], models: xr.DataArray) -> xr.Dataset:
    """Return the screens of several blocks as one, on block and model."""
    screens = xr.concat(
        parts, "block", data_vars="minimal", coords="minimal", compat="equals", combine_attrs="override"
    )
    settings = [json.loads(part.attrs["screen"]) for part in parts]
    settings_of_all = dict(settings[0])
    if settings_of_all["friction"] is not None:
        settings_of_all["friction"] = {
            label: friction for setting in settings for label, friction in setting["friction"].items()
        }
    return screens.assign_coords(model=models.variable).assign_attrs(
        screen=json.dumps(settings_of_all, ensure_ascii=False)
    )


QUANTILES = (0.05, 0.5, 0.95)
FACTORS = ("motion", "model", "sample")
NO_CAPACITY = "no_capacity_shares"
"""Attribute with the reason why capacities are not known."""


def summary(runs: xr.Dataset, fit: Fit) -> xr.Dataset:
    """Compute probabilities with their spread over samples, and shares of the variance of flags and capacities."""
    probability = overturning_probability(runs, fit.confidence)["probability"]
    alone = [dim for dim in FACTORS if runs.sizes[dim] == 1]
    varied = [dim for dim in FACTORS if dim not in alone]
    flags = gathered(lambda part: variance_shares(part["overturned"].squeeze(alone), varied), runs, ("level",))
    dataset = xr.Dataset(
        {
            "probability": probability.mean("sample").assign_attrs(
                units=DIMENSIONLESS, long_name="probability of overturning, inputs uncertain"
            ),
            "probability_quantile": _quantiles(probability, DIMENSIONLESS, "probability"),
            "sample_probability": probability,
            "flag_share": flags["share"],
            "flag_total_share": flags["total_share"],
        }
    )
    try:
        capacity = capacity_variance_shares(runs.squeeze(alone), flags["factor"].values.tolist())
    except ValueError as error:
        return dataset.assign_attrs({NO_CAPACITY: str(error)})
    keep = ("share", "total_share", "total_variance", "share_known", "rounding_share", "motions_used")
    return dataset.assign({f"capacity_{name}": capacity[name] for name in keep})


def fitted(runs: xr.Dataset, fit: Fit) -> xr.Dataset:
    """Fit the curve of every sample: median and dispersion on (model, sample)."""
    data = runs if fit.method != "binomial" else overturning_probability(runs, fit.confidence)
    fits = gathered(
        lambda part: fit_fragility(part, form=fit.form, method=fit.method, penalty=fit.penalty, intervals=WALD),
        data,
        ("model", "sample"),
    )
    names = {"median": "median of each sample", "dispersion": "dispersion of each sample"}
    return fits[list(names)].assign({name: fits[name].assign_attrs(long_name=text) for name, text in names.items()})


def pooled_curves(runs: xr.Dataset, fit: Fit, keep: bool) -> xr.Dataset:
    """Fit the curve of all samples, each a run of its motion, on model; with its replicates if `keep` is set."""
    return fit.curves(flags_of_samples(runs), replicates=keep, together=("sample",))


def flags_of_samples(runs: xr.Dataset) -> xr.Dataset:
    """Return the overturnings of runs without the coordinates of their samples."""
    return runs[["overturned"]].drop_vars(
        [name for name, coordinate in runs.coords.items() if "sample" in coordinate.dims]
    )


def yearly(
    risk: Risk,
    pooled: xr.Dataset,
    of_samples: xr.Dataset,
    highest: xr.DataArray | float,
    lowest: xr.DataArray | float,
    confidence: float,
) -> xr.Dataset:
    """Compute rates of all samples (`pooled`) and each (`of_samples`); chances are means of 1 - exp(-rate years)."""
    rates = risk.rates(of_samples, confidence)["rate"]
    text = "annual rate of overturning"
    chance = rates.copy(data=probability_in(rates.values, risk.years))
    variables = {
        "sample_rate": rates.assign_attrs(units=PER_YEAR, long_name=f"{text} of each sample"),
        "sample_rate_mean": rates.mean("sample").assign_attrs(
            units=PER_YEAR, long_name=f"mean over samples of the {text}"
        ),
        "sample_rate_quantile": _quantiles(rates, PER_YEAR, text),
        "sample_risk_probability_mean": chance.mean("sample").assign_attrs(
            units=DIMENSIONLESS,
            long_name=f"mean over samples of the probability of overturning in {years_text(risk.years)}",
        ),
    }
    return risk.of(pooled, confidence, highest, lowest=lowest).assign(variables)


def _quantiles(values: xr.DataArray, units: str, text: str) -> xr.DataArray:
    with warnings.catch_warnings():  # where no sample has a value there is none
        warnings.filterwarnings("ignore", "All-NaN", RuntimeWarning)
        quantiles = values.quantile(list(QUANTILES), "sample")
    quantiles = quantiles.assign_attrs(units=units, long_name=f"quantile over samples of the {text}")
    quantiles["quantile"] = quantiles["quantile"].assign_attrs(
        units=DIMENSIONLESS, long_name="probability of the quantile"
    )
    return quantiles
