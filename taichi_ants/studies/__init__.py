"""Sweeps as data, the runner of resumable blocks, and the folders of results."""
