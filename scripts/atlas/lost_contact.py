"""Figure of map 7. Losing contact."""


def draw(table, path):
    """Draws the rows of lost-contact.csv (dictionaries) into the PNG file at path."""
