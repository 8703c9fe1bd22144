"""Figure of map 1, step size against failure: Example I with the printed data."""

import matplotlib.pyplot as plt

COLOURS = {"8": "#1b9e77", "16": "#d95f02", "32": "#7570b3", "64": "#e7298a"}


def draw(table, path):
    """Draws the rows of step-size.csv (dictionaries) into the PNG file at path."""
    figure, (times, costs) = plt.subplots(1, 2, figsize=(11, 4.8), layout="constrained")
    for n, colour in COLOURS.items():
        rows = [row for row in table if row["n"] == n]
        fixed = [row for row in rows if row["step"]]
        chosen = [row for row in rows if not row["step"]]
        reference = float(rows[0]["reference"])
        times.axhline(reference, color=colour, linewidth=0.8)
        times.errorbar(
            [float(row["step"]) for row in fixed],
            [float(row["failure_time"]) for row in fixed],
            [float(row["uncertainty"]) for row in fixed],
            color=colour, marker="o", markersize=4, capsize=3, linewidth=1, label=f"n = {n}",
        )
        for kind, rows_of_kind, style in [("uniform", fixed, "o-"), ("auto", chosen, "s--")]:
            rows_of_kind = [row for row in rows_of_kind if int(row["steps"]) > 0]
            errors = [abs(float(r["failure_time"]) / reference - 1) for r in rows_of_kind]
            costs.loglog(
                [int(r["steps"]) + int(r["undone"]) for r in rows_of_kind], errors, style,
                color=colour, markersize=4, linewidth=1, label=f"n = {n}, {kind}",
            )
    times.set(
        xscale="log", xlabel="uniform step k (s)", ylabel="failure time (s)", ylim=(0, 0.13),
        title="time at which ζ* is reached, with the stated error bar\n(lines: limit k → 0)",
    )
    times.legend(frameon=False)
    costs.axhline(0.01, color="grey", linewidth=0.8, linestyle=":")
    costs.set(
        xlabel="steps, undone ones included", ylabel="relative error of the failure time",
        title="error against cost\n(dotted: 1 %)",
    )
    costs.legend(frameon=False, fontsize=8)
    figure.savefig(path, dpi=130)
    plt.close(figure)
