"""Executes a notebook in the current folder; a cell that fails ends it with its error. Prints the pictures, the cells
with an output, all cells of code, and what they wrote to standard error besides the progress."""

import re
import sys

try:
    import ipykernel, matplotlib, nbclient, nbformat, pandas, tqdm
except ImportError as error:
    sys.exit(f"skipped: {error}")

notebook = nbformat.read(sys.argv[1], as_version=4)
nbclient.NotebookClient(notebook, timeout=None).execute()
code = [cell for cell in notebook.cells if cell.cell_type == "code"]
outputs = [output for cell in code for output in cell.outputs]
pictures = sum("image/png" in output.get("data", {}) for output in outputs)
said = [output.text for output in outputs if output.get("name") == "stderr"]
said = [text.strip() for text in said if not re.fullmatch(r"[\s\d%|█▏▎▍▌▋▊▉:<?]*", text)]
print(pictures, sum(bool(cell.outputs) for cell in code), len(code), said)
