"""Figure of map 6. Conditioning."""


def draw(table, path):
    """Draws the rows of conditioning.csv (dictionaries) into the PNG file at path."""
