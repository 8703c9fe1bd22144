"""Runs a script embedded in `signorini`: python -c EMBEDDED NAME ARGUMENT…, with the sources of all scripts and the
template of the report as JSON on standard input. It writes no files of its own."""

import importlib
import json
import os
import signal
import sys
from importlib.abc import InspectLoader, MetaPathFinder
from importlib.util import spec_from_loader


class Sources(MetaPathFinder, InspectLoader):
    """Imports modules from their sources. A folder is a package."""

    def __init__(self, sources):
        self.sources = sources

    def find_spec(self, name, path, target=None):
        is_known = name.replace(".", "/") in self.sources or self.is_package(name)
        return spec_from_loader(name, self) if is_known else None

    def is_package(self, name):
        return any(source.startswith(name + "/") for source in self.sources)

    def get_source(self, name):
        return "" if self.is_package(name) else self.sources[name.replace(".", "/")]

    def get_data(self, path):
        return self.sources[path].encode()


def stop(number, frame):
    """Ends as Ctrl-C does, with the exit code of the signal."""
    raise KeyboardInterrupt(128 + number)


for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
    # `nohup` lets SIGHUP be ignored.
    if signal.getsignal(number) is not signal.SIG_IGN:
        signal.signal(number, stop)
sys.meta_path.insert(0, Sources(json.load(sys.stdin)))
# Modules in the working directory must not be imported.
sys.path = [path for path in sys.path if path]
name = sys.argv.pop(1)
try:
    code = importlib.import_module(name).main(f"signorini {name}")
    sys.stdout.flush()
except KeyboardInterrupt as stopped:
    code = stopped.args[0]
except OSError as error:
    # The reader of the output may have closed the pipe; this is no error. Python writes what it still has at its end.
    code = 0 if isinstance(error, BrokenPipeError) else 2
    if code:
        print("error:", ": ".join(str(part) for part in (error.filename, error.strerror) if part), file=sys.stderr)
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
sys.exit(code)
