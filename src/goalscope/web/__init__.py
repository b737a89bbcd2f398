"""The page for chatting, watching the belief move, and correcting it; and its HTTP interface."""
