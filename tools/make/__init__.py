"""Generators of what lies in the repository: pictures, tables, the example, the shape space."""
