"""Annual rates of adaptive studies that stop at a rate: from weighted runs, with rates of fitted curves as a check."""

from collections.abc import Hashable, Mapping, Sequence

import numpy as np
import xarray as xr

from ...core.facts import Fact
from ...core.parameters import USUAL_CONFIDENCE
from ...core.units import ENDS
from ...core.wording import listed_name
from ...fragility.analyses.sparse import weighted_rate_samples
from ...fragility.hazard.poisson import probability_in
from ...fragility.risk.modelling import LOWER, UPPER
from ...models import Block
from ..text.curve_notes import BEYOND, UNDER
from .estimates import Fit
from .gains import GAIN, gains_of_rates
from .risk import Risk

FITTED = "fitted_"
"""Prefix of the rate and the probability of the fitted curve, if the results' own are without a form of curve."""
OF_THE_MEAN = Fact("rate.mean_hazard")
"""Fact of rates at the mean of several hazard curves."""
OF_CURVE = (
    "rate_share",
    "rate_share_below",
    "rate_share_above",
    UNDER,
    BEYOND,
    "intensity_mean",
    "intensity_mode",
    "samples_used",
)
"""Variables of the fitted curve in addition to its rate."""
MOST_NAMED = 3


def form_free(
    fitted: Mapping[Hashable, xr.DataArray],
    runs: xr.Dataset,
    factor: xr.DataArray | float,
    risk: Risk,
    fit: Fit,
    blocks: Sequence[Block],
) -> tuple[dict[Hashable, xr.DataArray], list[Fact]]:
    """Return variables of annual rates without a form of curve, times `factor`, with fitted rates, and notes."""
    variables = dict(fitted)
    dims = fitted["rate"].dims
    for end in ENDS:
        for name in (f"rate{end}", f"risk_probability{end}"):
            text = str(fitted[name].attrs["long_name"])
            variables[f"{FITTED}{name}"] = fitted[name].assign_attrs(long_name=f"{text}, of the fitted curve")
    # (with too few falls the tail below them is not known, and the interval has no upper end: then there is none)
    known = np.isfinite(runs["rate_upper"])
    for end in ENDS:
        of_runs = runs[f"rate{end}"] if not end else runs[f"rate{end}"].where(known)
        rate = (of_runs * factor).transpose(*dims).assign_attrs(runs[f"rate{end}"].attrs)
        variables[f"rate{end}"] = rate
        chance = fitted[f"risk_probability{end}"]
        text = f"{chance.attrs['long_name']}, without a form of curve"
        values = probability_in(rate.values, risk.years)
        variables[f"risk_probability{end}"] = chance.copy(data=values).assign_attrs(long_name=text)
    for end in (LOWER, UPPER):
        shifted = fitted[f"rate{end}"] * (variables["rate"] / fitted["rate"]).transpose(*dims).values
        variables[f"rate{end}"] = shifted.assign_attrs(fitted[f"rate{end}"].attrs)
        given = fitted[f"risk_probability{end}"]
        variables[f"risk_probability{end}"] = given.copy(data=probability_in(shifted.values, risk.years))
    for name in OF_CURVE:
        attributes = fitted[name].attrs
        variables[name] = fitted[name].assign_attrs(long_name=f"{attributes['long_name']}, of the fitted curve")
    samples = weighted_rate_samples(runs, fit.replicates, fit.seed, fit.state) * factor
    sampled = xr.Dataset({"rate": variables["rate"], "rate_sample": samples.transpose(*dims, "replicate")})
    if risk.along is not None:
        of_size = risk.size_of(sampled.assign_coords(runs[[risk.along]].coords), fit.confidence)
        variables |= {
            name: variable.assign_attrs(variables[name].attrs) for name, variable in of_size.data_vars.items()
        }
    if GAIN in fitted:
        compared = gains_of_rates(sampled, risk.years, blocks, fit.confidence)
        assert compared is not None  # (of the fitted rates there are ratios)
        variables |= compared.data_vars
    facts = [Fact("rate.form_free"), *_differing(runs)]
    if risk.hazard.weights is not None:
        facts.append(OF_THE_MEAN)
    if fit.confidence != USUAL_CONFIDENCE:
        facts.append(Fact("rate.form_free_confidence", USUAL_CONFIDENCE))
    return variables, facts


def modelling_factor(curves: xr.Dataset, risk: Risk, fit: Fit) -> xr.DataArray | float:
    """Return the factor of beta_m in the mean on a rate: exp(k² β_m²/2) at a hazard slope k, from fitted curves."""
    if not fit.in_mean:
        return 1.0
    plain = curves.drop_vars([name for name in curves.data_vars if "replicate" in curves[name].dims])
    with_it, without = (risk.rates(of_curves, fit.confidence)["rate"] for of_curves in (fit.modelled(plain), plain))
    return with_it / without


def _differing(runs: xr.Dataset) -> list[Fact]:
    """Return the note on curves whose own rate differs from that without a form by more than the error."""
    apart = runs["rate_misfit"].values
    every = np.argwhere(apart != 0.0)
    if not every.size:
        return []
    laws = [f" under {law}" if apart.shape[1] > 1 else "" for law in runs["model"].values.tolist()]
    named = every[:MOST_NAMED].tolist()
    names = tuple(f"{listed_name(str(runs['block'].values[i]))}{laws[j]}" for i, j in named)
    more = {"of": apart.size, "values": [float(apart[i, j]) for i, j in named]}
    return [Fact("rate.form_apart", len(every), names=names, more=more)]
