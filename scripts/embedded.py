"""Runs a script embedded in `signorini`: python -I -X utf8 -c EMBEDDED NAME ARGUMENT…, with the sources of all scripts and
the template of the report as JSON on standard input. It writes no files of its own."""

import signal

# Ctrl-C has no effect before. Up to the main function a signal ends this process: packages turn exceptions during their import
# into errors of their own.
signal.signal(signal.SIGINT, signal.SIG_DFL)

import argparse
import importlib
import io
import json
import os
import re
import sys
import unicodedata
from importlib.abc import InspectLoader, MetaPathFinder
from importlib.util import spec_from_loader

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
PROCESS = os.getpid()


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
    """Text that does not command the terminal, as src/printable.rs shows it."""

    def write(self, text):
        super().write(re.sub(r"[^ -~\n\t\r]|\r(?!\n)", shown, text))
        return len(text)


def shown(of):
    """A character of a regular expression: `\\x1b` for one that controls, also as a byte; `\\u{202e}` for one that is not seen."""
    number, kind = ord(of[0]), unicodedata.category(of[0])
    if kind == "Cc" or 0xdc80 <= number < 0xdca0:
        return f"\\x{number & 0xff:02x}"
    return f"\\u{{{number:x}}}" if kind in ("Cf", "Zl", "Zp") else of[0]


def printable(stream, errors):
    """The same stream for such text, line by line."""
    return Printable(stream.detach(), encoding="utf-8", errors=errors, newline="", line_buffering=True)


def stop(number, frame):
    """Ends as Ctrl-C does, with the exit code of the signal; a second signal ends at once. Forked processes end with this one."""
    if os.getpid() != PROCESS:
        return
    for again in SIGNALS:
        signal.signal(again, lambda number, frame: os._exit(128 + number))
    raise KeyboardInterrupt(128 + number)


def refuse(parser, message):
    """Ends with an error of the arguments in two lines, without the usage."""
    parser.exit(2, f"error: {message}\n{parser.prog} --help says more\n")


def unraisable(ignored):
    """Ends where Python cannot raise what `stop` raises, as while it removes an object, and would print a traceback."""
    if isinstance(ignored.exc_value, KeyboardInterrupt):
        os._exit(ignored.exc_value.args[0])
    sys.__unraisablehook__(ignored)


def program(name):
    """The main function of a script. While its packages are imported the working folder is another one: matplotlib would
    follow a file matplotlibrc there, which can name programs."""
    here = os.open(".", os.O_PATH)
    os.chdir("/")
    main = importlib.import_module(name).main
    os.fchdir(here)
    return main


name = sys.argv.pop(1)
sys.unraisablehook, argparse.ArgumentParser.error = unraisable, refuse
try:
    sys.stdout, sys.stderr = printable(sys.stdout, "surrogateescape"), printable(sys.stderr, "backslashreplace")
    sys.meta_path.insert(0, Sources(json.load(sys.stdin)))
    main = program(name)
    for number in SIGNALS:
        # `nohup` lets SIGHUP be ignored.
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, stop)
    code = main(f"signorini {name}")
    sys.stdout.flush()
except KeyboardInterrupt as stopped:
    # Pictures that are being drawn are not waited for: their processes end with this one.
    os._exit(stopped.args[0])
except OSError as error:
    # The reader of the output may have closed the pipe; this is no error. Python writes what it still has at its end.
    code = 0 if isinstance(error, BrokenPipeError) else 2
    if code:
        print(f"error: {error.filename or 'standard output'}: {error.strerror}", file=sys.stderr)
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
except Exception as error:
    # Each script refuses what it knows to be wrong, by name.
    code = 2
    print(f"error: results are damaged, or of another version ({type(error).__name__}: {error}); run the scene again",
          file=sys.stderr)
sys.exit(code)
