"""The command lines: one file each, run by the script of that name in `experiments/`."""
