"""The simulated rig: one World, a camera that looks at it and a stage that moves in it."""
