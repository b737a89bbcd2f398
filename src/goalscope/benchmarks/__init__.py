"""How well goals are inferred where the true one is known: questions, and real dialogues."""
