"""Experiments: cells that are measured once each, and tables of their results."""
