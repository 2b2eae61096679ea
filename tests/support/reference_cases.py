"""The laws as the package builds them, and the arguments of the independent reference for the same draw."""

import toppling as tp

CASES = [
    ("discrete", {"rest": "elastic"}),
    ("discrete", {"rest": "rigid"}),
    ("giannini_masiani", {}),
    ("makris_konstantinidis", {}),
    ("vassiliou", {}),
    ("viscous", {}),
    ("energy_consistent", {"rest": "elastic"}),
    ("energy_consistent", {"rest": "rigid"}),
    ("housner", {"geometry": "exact"}),
    ("housner", {"geometry": "linear"}),
    ("housner", {"geometry": "bilinear"}),
]


def build(law, options, draw):
    """The package's law and the reference's arguments for one random draw."""
    lever = draw["lever"] if options.get("geometry") in (None, "bilinear") else "h"
    e, delta = draw["e"], draw["delta"]
    models = {
        "discrete": lambda: tp.DiscreteDamping(e, delta, lever, **options),
        "giannini_masiani": lambda: tp.GianniniMasiani(e, delta, lever),
        "makris_konstantinidis": lambda: tp.MakrisKonstantinidis(e, delta, lever),
        "vassiliou": lambda: tp.Vassiliou(delta, draw["coefficient"], lever),
        "viscous": lambda: tp.ViscousDamping(draw["zeta"], delta, lever),
        "energy_consistent": lambda: tp.EnergyConsistent(e, delta, lever, **options),
        "housner": lambda: tp.HousnerImpact(e, lever=lever, **options),
    }
    keywords = {k: draw[k] for k in ("alpha", "R", "inertia_factor", "e", "delta", "coefficient", "zeta", "dt")}
    return models[law](), {**keywords, "lever": lever, **options}
