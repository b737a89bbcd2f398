"""What outlives a process: episodes, rounds and tracking sessions in a database."""
