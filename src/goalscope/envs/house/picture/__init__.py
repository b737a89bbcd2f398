"""A room from above, as an SVG."""
