"""Scores and tables of results, made of the functions of `metrics`."""
