"""Fit LoRA adapters to dialogues with known goals."""
