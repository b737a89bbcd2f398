"""Experiments: cells that are each measured once, and the tables made of them."""
