#!/usr/bin/python3
"""Writes report.html of a run and opens it in the browser.

    signorini view out/lshape
"""

import sys
import webbrowser

import report


def main(prog=None):
    """Returns the exit code of the report."""
    return report.main(prog, __doc__, shown)


def shown(path):
    """Opens a page in the browser, or says that there is none."""
    try:
        is_open = webbrowser.open(path.resolve().as_uri())
    except webbrowser.Error:
        is_open = False
    if not is_open:
        print("no browser was found: open this page in one", file=sys.stderr)


if __name__ == "__main__":
    sys.exit(main())
