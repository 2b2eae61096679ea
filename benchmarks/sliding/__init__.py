"""Sliding blocks in the benchmark: what a sample costs, and Newmark's one-way block compared with another program."""
