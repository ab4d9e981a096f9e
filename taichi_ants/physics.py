"""The number of the physics."""

# Goes up with every change of the code that changes a result; it is a part of the keys of runs.
PHYSICS = 1
