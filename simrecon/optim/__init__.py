"""Optimisers of any function; none of them knows a simulator."""
