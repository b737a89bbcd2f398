"""Experiments: cells, each measured once, and tables of their results."""
