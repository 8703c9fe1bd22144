"""Figure of map 5. Active set on random problems."""


def draw(table, path):
    """Draws the rows of active-set.csv (dictionaries) into the PNG file at path."""
