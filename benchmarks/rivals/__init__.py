"""Other integrators of the same equations: fixed steps, and Taylor's method of another package."""
