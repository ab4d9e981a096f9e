"""Bounds of ants and colonies, and simple policies to compare learned ones with."""
