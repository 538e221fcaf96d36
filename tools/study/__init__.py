"""Studies behind the decisions: what settings, priors and clips are worth."""
