"""What `peers.py` measures, one file for each system: ours, the same in other libraries, others."""
