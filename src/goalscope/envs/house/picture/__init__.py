"""A room from above, in a terminal or as an SVG."""
