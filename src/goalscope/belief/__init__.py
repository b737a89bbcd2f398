"""The belief over goals: likelihood, calibration, goal management."""
