"""Figure of map 1. Step size against failure."""


def draw(table, path):
    """Draws the rows of step-size.csv (dictionaries) into the PNG file at path."""
