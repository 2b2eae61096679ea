"""Compiled resampling of motions: number of draws of each pattern of outcomes, and the runs in each cell."""

from ...core.compiled import kernel


@kernel(keep=True, error_model="python")
def resample(weights, order, firsts, starts, cells, counts, of_patterns, drawn):
    """Add weights of motions to weights of patterns and of cells, `of_patterns` and `drawn`, which begin at zero.

    `weights` (replicate, cluster). `order`: the clusters of pattern p are `order[firsts[p]:firsts[p + 1]]`. Its cells
    are `cells[starts[p]:starts[p + 1]]`, with the numbers of runs in `counts`. `of_patterns` (replicate, pattern),
    `drawn` (replicate, cell). All are whole numbers: sums are exact.
    """
    for r in range(weights.shape[0]):
        for p in range(starts.size - 1):
            times = 0.0
            for i in range(firsts[p], firsts[p + 1]):
                times += weights[r, order[i]]
            of_patterns[r, p] = times
            if times > 0.0:
                for i in range(starts[p], starts[p + 1]):
                    drawn[r, cells[i]] += times * counts[i]
