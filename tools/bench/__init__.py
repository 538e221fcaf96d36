"""Measurements: speed, accuracy, memory, and how batches stand being killed."""
