"""The engine of independent runs: each run is one parallel task of whole episodes."""
