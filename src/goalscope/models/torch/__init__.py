"""Models run by Transformers."""
