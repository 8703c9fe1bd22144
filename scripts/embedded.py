"""Runs a script that `signorini` carries: python -c EMBEDDED NAME ARGUMENT…, with the sources of
all its scripts as JSON on standard input. Nothing is written to disk."""

import importlib
import json
import sys
from importlib.abc import InspectLoader, MetaPathFinder
from importlib.util import spec_from_loader


class Sources(MetaPathFinder, InspectLoader):
    """Imports modules from their sources."""

    def __init__(self, sources):
        self.sources = sources

    def find_spec(self, name, path, target=None):
        return spec_from_loader(name, self) if name in self.sources else None

    def get_source(self, name):
        return self.sources[name]


sys.meta_path.insert(0, Sources(json.load(sys.stdin)))
# Not from the folder in which the person happens to be.
sys.path = [path for path in sys.path if path]
name = sys.argv.pop(1)
try:
    sys.exit(importlib.import_module(name).main(f"signorini {name}"))
except KeyboardInterrupt:
    sys.exit(130)
