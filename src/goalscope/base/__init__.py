"""What every room uses: types, text, statistics, optional packages."""
