"""Calls that are refused or doubted stand in refusals.csv and doubts.csv."""

from refusals import doubts, pytest_generate_tests, refusal

__all__ = ["doubts", "pytest_generate_tests", "refusal"]
