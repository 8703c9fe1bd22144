"""Figure of map 4. TAO's types."""


def draw(table, path):
    """Draws the rows of tao-types.csv (dictionaries) into the PNG file at path."""
