"""Other integrators of the same equations: fixed steps, scipy, and packages from elsewhere."""
