"""Floors: elastic buildings between the ground and the contents, floor histories from files, and the floor demands of
FEMA P-58.
"""
