"""The web page for chatting, watching the belief and correcting it, and its HTTP interface."""
