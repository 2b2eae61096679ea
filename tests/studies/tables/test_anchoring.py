"""The ranking of what anchoring saves marks the pieces on which no advice can rest."""

import numpy as np
import xarray as xr

from toppling.studies.tables.assessment import doubtful_items, ranked


def ranking(**coordinates):
    saving = (("model", "item"), np.array([[3.0, 1.0]]), {"units": "EUR"})
    values = dict.fromkeys(("saving", "saving_lower", "saving_upper"), saving)
    ranks = {name: (("model", "item"), np.array([[1, 2]])) for name in ("rank", "rank_lower", "rank_upper")}
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


def test_a_squat_piece_is_marked():
    table = ranked(ranking(doubtful=("item", [True, False])))
    assert table.texts("item") == ["bust ‡", "shelf"]
    assert "no ground for advice" in table.note


def test_nothing_is_marked_where_nothing_is_doubted():
    for given in (ranking(), ranking(doubtful=("item", [False, False]))):
        table = ranked(given)
        assert table.column("item") == ["bust", "shelf"]
        assert "‡" not in table.note
        assert not doubtful_items(given).any()
