"""Many clips with one command: a queue on worker processes that loses nothing (`simrecon batch`)."""
