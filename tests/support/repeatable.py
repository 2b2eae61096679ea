"""Hypothesis with the same examples in every run."""

from hypothesis import HealthCheck
from hypothesis.internal.conjecture import providers

REPEATABLE = {"derandomize": True, "deadline": None, "database": None, "suppress_health_check": list(HealthCheck)}
"""Arguments of ``settings``: a seed from the test itself, nothing kept between runs, no time limit."""


def no_constants(constants=providers.Constants()):  # noqa: B008 - one object, as Hypothesis' own has it
    """In place of the constants of every source that is loaded, which Hypothesis mixes into its examples.

    With them another literal anywhere, or another choice of tests, would be other examples.
    """
    return constants


assert callable(providers._get_local_constants), "Hypothesis takes its constants in another way now"
providers._get_local_constants = no_constants
