"""Descriptions of the models of studies."""
