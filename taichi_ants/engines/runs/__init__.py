"""Many independent runs: one parallel task a run, whole episodes inside it."""
