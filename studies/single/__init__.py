"""One block under one motion: the commands that show motions and single runs."""
