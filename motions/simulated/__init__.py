"""Simulated motions: filtered noise, site-based, near-fault and seismological models, and pulses."""
