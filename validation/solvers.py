"""The contact solvers that the program has, as it lists them itself."""

import subprocess


def solvers(binary):
    """Their names, the default first."""
    listing = subprocess.run([str(binary), "solvers"], capture_output=True, text=True, check=True)
    return [line.split("\t")[0] for line in listing.stdout.splitlines()]
