"""Runs a script embedded in `signorini`: python -I -X utf8 -c EMBEDDED NAME ARGUMENT…, with the sources of all scripts and
the template of the report as JSON on standard input. It writes no files of its own."""

import importlib
import io
import json
import os
import re
import signal
import sys
from importlib.abc import InspectLoader, MetaPathFinder
from importlib.util import spec_from_loader

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


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


class Printable(io.TextIOWrapper):
    """Text whose control characters are shown as \\x1b: names in files of others must not command the terminal."""

    def write(self, text):
        super().write(re.sub(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f]|\r(?!\n)", lambda of: f"\\x{ord(of[0]):02x}", text))
        return len(text)


def printable(stream, errors):
    """The same stream for such text, line by line."""
    return Printable(stream.detach(), encoding="utf-8", errors=errors, newline="", line_buffering=True)


def stop(number, frame):
    """Ends as Ctrl-C does, with the exit code of the signal; a second signal ends at once."""
    for again in SIGNALS:
        signal.signal(again, lambda number, frame: os._exit(128 + number))
    raise KeyboardInterrupt(128 + number)


def program(name):
    """The main function of a script. While its packages are imported the working folder is another one: matplotlib would
    follow a file matplotlibrc there, which can name programs."""
    here = os.open(".", os.O_PATH)
    os.chdir("/")
    main = importlib.import_module(name).main
    os.fchdir(here)
    return main


name = sys.argv.pop(1)
try:
    for number in SIGNALS:
        # `nohup` lets SIGHUP be ignored. SIGINT is ignored up to here.
        if number == signal.SIGINT or signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, stop)
    sys.stdout, sys.stderr = printable(sys.stdout, "surrogateescape"), printable(sys.stderr, "backslashreplace")
    sys.meta_path.insert(0, Sources(json.load(sys.stdin)))
    code = program(name)(f"signorini {name}")
    sys.stdout.flush()
except KeyboardInterrupt as stopped:
    code = stopped.args[0]
except OSError as error:
    # The reader of the output may have closed the pipe; this is no error. Python writes what it still has at its end.
    code = 0 if isinstance(error, BrokenPipeError) else 2
    if code:
        print(f"error: {error.filename or 'standard output'}: {error.strerror}", file=sys.stderr)
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
except Exception as error:
    # Each script refuses what it knows to be wrong, by name.
    code = 2
    print(f"error: not as `run` writes results ({type(error).__name__}: {error}); run the scene again", file=sys.stderr)
sys.exit(code)
