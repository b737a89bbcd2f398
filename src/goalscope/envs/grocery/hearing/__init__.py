"""What a person asks a shop for, and rules out; `hear.hear` is the way in."""
