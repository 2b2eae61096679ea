"""Assessments from one set of options."""

from toppling.studies.buildings.assessment import Assessment, assess

OF_RUN = ("sides", "client", "progress")


def assessed(inventory, *given, **options):
    """The assessment of an inventory; options are those of `Assessment` and of `assess`."""
    own = {name: options.pop(name) for name in OF_RUN if name in options}
    return assess(inventory, Assessment(*given, **options), **own)
