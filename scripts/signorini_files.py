"""Writes files by the rule of `signorini run`: what it did not write is not replaced, and what it writes appears whole."""

import os
import re
import secrets
from contextlib import contextmanager
from pathlib import Path

# The first line of scene.toml in a folder of results, as src/scene/as_run.rs writes it.
FIRST_LINE = b"# As run by signorini; the results stand beside it."
# The names of incomplete files begin with this, as in src/whole_file.rs.
PARTIAL = ".signorini-partial-"


def check_folder(folder):
    """Raises an OSError if a link stands in the place of a folder of outputs."""
    if Path(folder).is_symlink():
        raise OSError(None, "a link is there; name the folder that it leads to, or move the link away", str(folder))


def is_of_run(path):
    """Whether a file is in a folder of results: the names of results there belong to the program."""
    return begins(Path(path).with_name("scene.toml"), FIRST_LINE)


def begins(path, start):
    """Whether a file begins with these bytes."""
    try:
        with open(path, "rb") as file:
            return file.read(len(start)) == start
    except OSError:
        return False


def is_of_study(path):
    """Whether a file is in the folder of a study: there is an empty file `.locks`, and study.csv has the head of its table. The
    names of tables and pictures there belong to the program."""
    locks, table = Path(path).with_name(".locks"), Path(path).with_name("study.csv")
    return (locks.is_file() and not locks.is_symlink() and not locks.stat().st_size and (
        Path(path) == locks or table.is_file() and bool(re.match(rb"run,.*\bstatus\b", table.read_bytes()))))


def check(path, is_own=is_of_run):
    """Raises an OSError if there is something at a path that this program did not write. It writes no links."""
    path = Path(path)
    if os.path.lexists(path) and (path.is_symlink() or not path.is_file() or not is_own(path)):
        raise OSError(None, "no run of signorini left it there; move it away, or choose another folder", str(path))


@contextmanager
def whole(path, is_own=is_of_run):
    """The path of a file that takes the place of `path` in the end. An error of writing it names `path`."""
    path = Path(path)
    check(path, is_own)
    # Matplotlib takes the format from the ending.
    part = path.with_name(f"{PARTIAL}{secrets.token_hex(4)}{path.suffix}")
    try:
        yield part
        os.replace(part, path)
    except OSError as error:
        name = path if error.filename in (None, str(part)) else error.filename
        raise OSError(error.errno, error.strerror or str(error), str(name)) from None
    finally:
        part.unlink(missing_ok=True)
