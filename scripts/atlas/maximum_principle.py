"""Figure of map 2. Maximum principle."""


def draw(table, path):
    """Draws the rows of maximum-principle.csv (dictionaries) into the PNG file at path."""
