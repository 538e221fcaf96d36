"""Training and evaluation of what is learned: the pose prior and the primitives of a shape."""
