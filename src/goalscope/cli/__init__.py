"""The `goalscope` command: the application in `main`, and a module for each command or group."""
