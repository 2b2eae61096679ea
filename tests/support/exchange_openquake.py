"""Exported models read by OpenQuake's own reader: `make test-exchange`.

Run by a Python that has OpenQuake and need not have this project: `python tests/support/exchange_openquake.py FOLDER`.
"""

import json
import sys
from importlib import metadata
from pathlib import Path

import numpy as np
from openquake.hazardlib import nrml
from openquake.risklib import read_nrml


def main(folder):
    read_nrml.update_validators()
    rows = json.loads((folder / "expected.json").read_text(encoding="utf-8"))["openquake"]
    models, worst = {}, {}
    for row in rows:
        name = row["file"]
        if name not in models:
            models[name] = nrml.to_python(str(folder / name))
        model = models[name]
        functions = model[row["imt"], row["id"]].build(model.limitStates)
        assert len(functions) == len(row["probability"]), row["id"]
        for function, expected in zip(functions, row["probability"], strict=True):
            error = np.abs(function(np.array(row["levels"])) - expected)
            # below and above its tails OpenQuake holds a continuous function at 0, or at what it is there
            tails = np.minimum(expected, 1.0 - np.array(expected)) <= 1e-6
            assert np.all(error <= np.where(tails, 1e-6, row["error"])), (row["id"], error)
            inside = error[~tails]
            worst[row["error"]] = max(worst.get(row["error"], 0.0), float(inside.max(initial=0.0)))
    for name, model in models.items():
        assert {key[1] for key in model} == {row["id"] for row in rows if row["file"] == name}, name
    shown = ", ".join(f"{value:.1e} (allowed {bound:g})" for bound, value in worst.items())
    version = metadata.version("openquake.engine")
    print(f"OpenQuake {version}: {len(rows)} functions of {len(models)} models, errors {shown}")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
