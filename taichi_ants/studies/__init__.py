"""Studies: sweeps from files, work in resumable blocks, and folders of results."""
