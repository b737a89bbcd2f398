"""Algorithm 1, and the modules that it is made of."""
