"""The words of `status`: why a curve, a size or a slenderness is missing or must not be trusted."""

from __future__ import annotations

from typing import Final

OK: Final = "ok"

# of a curve
NO_RUNS: Final = "no runs"
ONE_LEVEL: Final = "one level"
NONE: Final = "no overturning"
ALL: Final = "all overturned"
SEPARATED: Final = "separated"
DECREASING: Final = "not increasing"
FAILED: Final = "not converged"
FLAT: Final = "flat"

# of a size or slenderness that meets a rate
TOO_HIGH: Final = "all above the target"
TOO_LOW: Final = "all below the target"
CROSSED: Final = "crosses the target more than once"
NO_RATE: Final = "no rate"

# of a curve in a file of another program
ABSENT: Final = "not in the file"
INCOMPLETE: Final = "incomplete"
