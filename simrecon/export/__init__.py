"""A result as files of other programs."""
