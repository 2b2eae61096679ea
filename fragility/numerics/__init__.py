"""Binomial proportions, quadrature, sums over items, and slabs of large arrays; nothing of blocks, laws or motions."""
