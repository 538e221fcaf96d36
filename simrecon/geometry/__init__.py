"""Rotations, splines and cameras: geometry without a simulator."""
