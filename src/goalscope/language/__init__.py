"""Words become structure: orders, the reader, the state of the dialogue."""
