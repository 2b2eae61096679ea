"""Assessments from one set of options, and with laws before pieces, as loops over them in tests count them."""

from toppling.studies.buildings import anchoring as of_anchoring, assessment

Assessment = assessment.Assessment
OF_RUN = ("sides", "client", "progress")


def by_law(results):
    """The results with laws first, then pieces."""
    return results.transpose("model", "block", "place", ..., missing_dims="ignore")


def assess(*arguments, **options):
    """The assessment of an inventory, by law."""
    return by_law(assessment.assess(*arguments, **options))


def anchoring(*arguments, **options):
    """What anchoring saves, by law."""
    return by_law(of_anchoring.anchoring(*arguments, **options))


def assessed(inventory, *given, **options):
    """The assessment of an inventory; options are those of `Assessment` and of `assess`."""
    own = {name: options.pop(name) for name in OF_RUN if name in options}
    return assess(inventory, Assessment(*given, **options), **own)
