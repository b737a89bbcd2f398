"""The `goalscope` command: `main` holds it, a file for each command or group beside it."""
