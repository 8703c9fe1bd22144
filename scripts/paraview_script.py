"""Writes a script that opens a run in ParaView: paraview_view.py with the scales of the run."""

import pprint
from importlib.util import find_spec

from signorini_files import whole


def write_script(results, limits):
    """Writes open_in_paraview.py into the result folder; returns its path."""
    run = {
        "title": results.title,
        "folder": str(results.folder.resolve()),
        "time": results.time,
        "size": results.size,
        "factor": float(limits.factor),
        "damage": limits.damage,
        "stress_unit": results.units["stress"],
        "time_unit": results.units["time"],
        "stress": limits.stress,
        "pressure": float(limits.pressure),
    }
    # Both modules come from the same place.
    text = find_spec("paraview_view").loader.get_source("paraview_view")
    text = text.replace("RUN = {}", f"RUN = {pprint.pformat(run, sort_dicts=False)}", 1)
    path = results.folder / "open_in_paraview.py"
    with whole(path) as part:
        part.write_text(text, encoding="utf-8")
    return path
