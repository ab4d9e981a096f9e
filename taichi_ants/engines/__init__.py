"""The engines: they allocate memory, hold the kernels and turn rules into runs."""
