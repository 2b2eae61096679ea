"""Motions of a seed are the same to the last digit on one kind of processor; sums of products are rounded by its BLAS.

Files with motions, or with outcomes of motions, were made on processors with AVX-512: only there comparisons are exact.
"""

from llvmlite import binding

# (those of AMD have these vectors too, and other digits: 1 of 400 outcomes differs)
AS_STORED = bool(binding.get_host_cpu_features().get("avx512f", False)) and "znver" not in binding.get_host_cpu_name()
"""Whether this processor's generated motions have the digits of the stored ones."""
