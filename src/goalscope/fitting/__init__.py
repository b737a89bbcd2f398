"""Fit LoRA adapters to dialogues with known goals, and teach models to write."""
