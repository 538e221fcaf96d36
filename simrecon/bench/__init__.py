"""Benchmark suites: clips, ablations, seeds; runs that resume; tables in Markdown and JSON."""
