"""What a person asks a robot for, rules out and allows; `hear.hear` is the way in."""
