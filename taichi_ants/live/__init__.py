"""A colony that people watch and change while it runs, in a browser."""
