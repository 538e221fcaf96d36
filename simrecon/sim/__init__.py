"""All that knows MuJoCo, and nothing else: states, rollouts, addresses, poses and contacts."""
