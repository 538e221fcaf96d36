"""Outputs of networks that estimate SMPL or SMPL-X bodies, and motion capture in those bodies."""
