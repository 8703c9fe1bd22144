"""Figure of map 3. Penalty-duality: ω against λω."""


def draw(table, path):
    """Draws the rows of penalty-duality.csv (dictionaries) into the PNG file at path."""
