"""The systems that `peers.py` measures, one file for each library."""
