"""docs/rocking.gif: a bookcase that rocks and falls, as the README shows it.

`make film` runs it.
"""

from __future__ import annotations

import sys
from pathlib import Path

import toppling as tp

HERE = Path(__file__).parent


def main(out: Path = HERE / "rocking.gif") -> Path:
    """Write the film: small, so that a page loads quickly."""
    envelope = tp.motions.RiseStrongDecay(rise=1.0, strong_end=6.0, decay=0.5)
    motion = tp.motions.CloughPenzien(duration=9.0, envelope=envelope).sample(1, seed=19)
    shaking = tp.motions.scale_to(motion, 0.35 * tp.units.STANDARD_GRAVITY)
    run = tp.simulate(tp.catalogue["bookcase-5-shelf"], tp.HousnerImpact(), shaking)
    return tp.animate(run, out, fps=20, size=400)


if __name__ == "__main__":
    print(main(*(Path(one) for one in sys.argv[1:])))
