"""Live pages: watch a colony in a browser and change it while it runs."""
