"""Compiled recurrences of oscillators and filters: plain numbers and arrays only."""
