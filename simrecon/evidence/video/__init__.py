"""Video to evidence: decoding, BlazePose, tracking of one person, weights, lenses."""
