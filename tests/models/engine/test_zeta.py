"""The energy-consistent damping ratio against 40-digit solutions, and against the crossing it is meant for."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from toppling.models.engine.regions import energy_consistent_zeta

# (speed in, speed out, ratio): 40-digit roots (mpmath) of the crossing from -1 to 1 of z'' + 2 zeta z' + z = 0;
# under-, over- and nearly critically damped, stopping at the far edge, hardly any loss
EXACT = [
    (0.1, 0.05, 0.001186532900938040796656),
    (0.5, 0.0, 0.03624195944872307259002),
    (1.0, 0.9, 0.01904900356986290545684),
    (4.0, 3.6, 0.09776989639211954470276),
    (4.0, 0.0, 0.8490899233673680516474),
    (7.9, 3.04, 1.199934753198715049406),
    (10.0, 9.99, 0.002491702585173589236004),
    (4.5, 2.0, 0.6045350090732912541923),
    (4.3, 0.0, 0.9256341381513398910081),
    (62.3, 48.1, 3.549607813794794093583),
    (211.0, 0.0, 52.73099955085548381216),
    (500.0, 450.0, 12.49998150206887382068),
    (0.03, 0.029999, 9.540660425158663080881e-9),
]


@pytest.mark.parametrize(("speed", "exit_speed", "zeta"), EXACT)
def test_forty_digits(speed, exit_speed, zeta):
    assert energy_consistent_zeta(speed, exit_speed) == pytest.approx(zeta, rel=6e-16)


def test_the_crossing_leaves_as_it_should():
    """Integrated across the zone, random crossings come out at the speed asked for."""
    rng = np.random.default_rng(1)
    for _ in range(60):
        speed = float(np.exp(rng.uniform(-2.0, 4.0)))
        exit_speed = speed * rng.uniform(0.05, 0.999)
        zeta = energy_consistent_zeta(speed, exit_speed)

        def edge(_, state):
            return state[0] - 1.0

        edge.terminal = True
        path = solve_ivp(
            lambda _, state, zeta=zeta: [state[1], -2.0 * zeta * state[1] - state[0]],
            (0.0, 50.0),
            [-1.0, speed],
            method="DOP853",
            rtol=1e-12,
            atol=1e-13,
            events=edge,
        )
        assert path.y_events[0][0][1] == pytest.approx(exit_speed, rel=1e-8, abs=1e-9)


def test_ratio_falls_with_the_exit_speed():
    """Through critical damping without a step."""
    for speed, jump in ((0.3, 1e-3), (4.4, 0.005), (30.0, 0.2)):
        ratios = [energy_consistent_zeta(speed, f * speed) for f in np.linspace(0.0, 1.0, 4001)]
        assert np.all(np.diff(ratios) < 0.0)
        assert ratios[-1] == 0.0
        second = np.diff(ratios, 2)
        np.testing.assert_allclose(second[1:], second[:-1], rtol=jump)
