"""Learn the likelihood from people: LoRA adapters from dialogues whose goals are known."""
