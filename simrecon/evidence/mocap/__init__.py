"""Motion capture: skeletons and markers."""
