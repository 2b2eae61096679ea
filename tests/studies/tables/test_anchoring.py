"""The ranking of what anchoring saves marks the pieces on which no advice can rest."""

import matplotlib.pyplot as plt
import numpy as np
import xarray as xr

from toppling.studies.plots import selection
from toppling.studies.plots.assessment import bars
from toppling.studies.tables.assessment import doubtful_items


def ranking(**coordinates):
    saving = (("model", "item"), np.array([[3.0, 1.0]]), {"units": "EUR"})
    values = dict.fromkeys(("alone", "saving", "saving_lower", "saving_upper"), saving)
    ranks = {"rank": (("model", "item"), np.array([[1, 2]]))}
    return xr.Dataset(
        {**values, **ranks, "saving_share": (("model", "item"), np.array([[0.75, 0.25]]))},
        {
            "model": ["housner"],
            "item": ["bust", "shelf"],
            "floor": ("item", ["1", "2"]),
            "count": ("item", [1, 1]),
            "cost": ("item", np.full(2, np.nan)),
            **coordinates,
        },
        {"objective": "loss", "objective_text": "expected loss", "objective_units": "EUR", "confidence": 0.95},
    )


def marked(given):
    """Return the labels of the bars of the figure."""
    ax = bars(given, selection.laws(given), plt.figure().subplots())
    return [label.get_text() for label in ax.get_yticklabels()]


def test_a_squat_piece_is_marked():
    labels = marked(ranking(doubtful=("item", [True, False])))
    assert ["‡" in label for label in labels] == ["bust" in label for label in labels]


def test_nothing_is_marked_where_nothing_is_doubted():
    for given in (ranking(), ranking(doubtful=("item", [False, False]))):
        assert not any("‡" in label for label in marked(given))
        assert not doubtful_items(given).any()
