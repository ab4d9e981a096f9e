"""The engines, which compile the rules into kernels and run ants."""
