"""The arithmetic of kernels: random bits, and functions whose results are equal everywhere."""
