"""Motions drawn anew, compiled: how often each pattern of outcomes comes, and how many runs each cell then holds."""

from numba import njit


@njit(cache=True, nogil=True)
def resample(weights, order, firsts, starts, cells, counts, of_patterns, drawn):
    """Weights of motions as weights of patterns and of cells, added to `of_patterns` and `drawn`, which begin at zero.

    weights (replicate, cluster); order: the clusters of pattern p are order[firsts[p]:firsts[p + 1]]; its cells are
    cells[starts[p]:starts[p + 1]], with so many runs as counts say; of_patterns (replicate, pattern), drawn
    (replicate, cell).  All are whole numbers: sums are exact.
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
