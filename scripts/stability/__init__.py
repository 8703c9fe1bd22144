"""The figures of the stability study, one module per map."""

CELL_COLOURS = {"correct": "#7fbf7b", "refused": "#fdd49e", "wrong": "#d7301f"}


def verdicts(table):
    """How many rows of a map are of which verdict, for its title."""
    counts = {v: sum(r["verdict"] == v for r in table) for v in CELL_COLOURS}
    return ", ".join(f"{n} {v}" for v, n in counts.items())
