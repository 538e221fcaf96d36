"""Sampling-based trajectory optimisation with the simulator in the loop (Gärtner et al. 2022)."""
