"""The engine's rivals, compiled: Runge-Kutta and multistep integrators of the same equations."""
