"""Engines: each takes a window and where the last one ended, and returns a solved window."""
