#!/usr/bin/python3
"""Runs a scene with all combinations of some values, as many runs at once as this process has cores, and prints their
table.

    signorini study geo/lshape.toml --set material.young=1e5,2e5,4e5 --set mesh.size=0.5,0.25
    signorini study geo/lshape.toml --cases cases.csv --plot zeta_min,foundation.force_y

Each row of cases.csv is a run; the columns are keys or names of constants, and an empty cell leaves a key as it is.
Each run has a folder below OUT, named by its values, or by the column `label`; OUT/study.csv is the table. A study
that was interrupted goes on: runs that are complete are not repeated, unless the scene or its files have changed. Another
study needs another OUT.
Studies with the same OUT, also on several machines, divide the runs: each waits at its end for those that another has
started. Runs write no frames (output.every = 0), unless --frames or a --set asks for them; those of one run are made
by `signorini run OUT/NAME/scene.toml --set output.every=1`. A list is split at commas outside brackets and quotes.
What follows `--` are other arguments of `run`.
"""

import argparse
import csv
import difflib
import errno
import fcntl
import itertools
import os
import re
import signal
import subprocess
import sys
import time
import tomllib
import zlib
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from contextlib import chdir, contextmanager, suppress
from pathlib import Path

from server import Server
from signorini_files import check, check_folder, is_of_study, whole
from signorini_summaries import ENTRIES, KINDS, columns_of, is_study, rows_of, runs_of, summary_of, unknown
from table import names_of, printed, refused, write_table

# The column of --cases that names the runs.
LABEL = "label"
# The longest name of a folder, bytes.
LONGEST = 120


def values_of(text):
    """KEY and its values, from KEY=A,B,C."""
    key, separator, values = text.partition("=")
    if not separator:
        raise argparse.ArgumentTypeError(f"{text}: write KEY=VALUE or KEY=VALUE,VALUE,…")
    found, part, depth, quote = [], "", 0, ""
    for letter in values:
        if quote:
            quote = "" if letter == quote else quote
        elif letter in "'\"":
            quote = letter
        else:
            depth += (letter in "[{(") - (letter in "]})")
        if letter == "," and not depth and not quote:
            found.append(part)
            part = ""
        else:
            part += letter
    found = [part.strip() for part in [*found, part]]
    if again := next((value for n, value in enumerate(found) if value in found[:n]), None):
        raise argparse.ArgumentTypeError(f"{key.strip()} has the value {again} twice; remove one")
    return key.strip(), found


def cases_of(path):
    """The keys of a CSV file without `label`, and for each row: its label, and the keys with their values; empty cells are
    left out."""
    def refuse(problem):
        raise argparse.ArgumentTypeError(f"{path}: {problem}")

    try:
        text = Path(path).read_bytes().decode("utf-8-sig")
    except OSError as error:
        refuse(error.strerror)
    except ValueError:
        text = "\0"
    if "\0" in text:
        refuse("is not in UTF-8; save the file in this encoding")
    reader = csv.reader(text.splitlines())
    try:
        lines = [(reader.line_num, [cell.strip() for cell in row]) for row in reader if any(row)]
    except csv.Error as error:
        refuse(f"line {reader.line_num}: {error}")
    if len(lines) < 2:
        refuse("needs a head with keys, and a row for each run")
    (first, head), *rows = lines
    if any(";" in key for key in head):
        refuse(f"line {first} has semicolons; separate the cells by commas")
    for line, row in rows:
        if len(row) != len(head):
            refuse(f"line {line} has {len(row)} cells and the head {len(head)}; leave cells empty between commas, and put "
                   "values with commas in quotes")
    cases, labels = {}, {}
    for line, row in rows:
        case = tuple((key, value) for key, value in zip(head, row) if value and key != LABEL)
        if case in cases:
            refuse(f"lines {cases[case]} and {line} are the same run; remove one of them")
        cases[case] = line
        label = dict(zip(head, row)).get(LABEL, "")
        if label and label in labels:
            refuse(f"lines {labels[label]} and {line} have the label {label}; give each run its own")
        labels[label] = line
    found = [dict(zip(head, row)).get(LABEL, "") for _, row in rows]
    return [key for key in head if key != LABEL], list(zip(found, map(list, cases)))


def names_for(runs):
    """The names of the runs' folders from their labels and values. Names that would be too long or equal end with a
    checksum."""
    def plain(run):
        label, values = run
        parts = [*filter(None, [label]), *(f"{key.rpartition('.')[2]}={value}" for key, value in values)]
        return re.sub(r"[^\w.=+-]", "_", ",".join(parts).replace(",", "__")) or "run"

    counts = Counter(map(plain, runs))
    return [name if len(name.encode()) <= LONGEST and counts[name] == 1
            else f"{name.encode()[:LONGEST - 9].decode(errors='ignore')}-{zlib.crc32(str(run).encode()):08x}"
            for run, name in zip(runs, map(plain, runs))]


def inputs_of(scene):
    """The scene's file, and what it reads: its mesh or geometry, the files that a geometry includes, and its tables; those
    that exist."""
    found, open_files = [], [Path(scene)]
    while open_files:
        file = open_files.pop()
        # A text may be too long for a name.
        if file in found or not os.path.exists(file):
            continue
        found.append(file)
        if os.path.isfile(file) and file.suffix in (Path(scene).suffix, ".geo"):
            # Quotes within a string of TOML have backslashes.
            text = file.read_text(encoding="utf-8", errors="replace").replace('\\"', "'")
            names = re.findall(r"""["']([^"'()]+\.\w+)["']|(?:table|spline|pchip)\(["']([^"']+)["']""", text)
            open_files += [file.parent / name for pair in names for name in pair if name]
    return found


def command_of(scene, folder, chosen, more):
    """The arguments of a run with these values."""
    sets = [word for key, value in chosen for word in ("--set", f"{key}={value}")]
    return ["run", scene, *sets, "--out", str(folder), *more]


def is_complete(folder, command, inputs):
    """Whether this command has finished in a folder since its inputs were changed last."""
    try:
        summary = summary_of(folder)
    except ValueError:
        return False
    written = (folder / "summary.json").stat().st_mtime
    # What was interrupted goes on; what is complete stays.
    words = [[word for word in of if word != "--restart"] for of in (summary["provenance"]["command"][1:], command)]
    return ("error" not in summary and words[0] == words[1]
            and all(file.stat().st_mtime <= written for file in inputs))


def outcome(folder, error):
    """The summary of a run of the study, or only its error if the run was refused."""
    summary = summary_of(folder) if os.path.exists(folder / "summary.json") else {}
    lines = [line.removeprefix("error: ") for line in error.splitlines() if line.startswith("error")]
    return summary if not error or "error" in summary else {"error": " ".join(lines) or error}


def other_study(out, folders, scene):
    """Why the table in `out` is that of another study: it lists other runs, or they are of another scene; "" if it is not."""
    if not is_study(out):
        return ""
    listed = [Path(run) for run in runs_of(out)]
    others = [run.name for run in listed if run not in folders]
    with suppress(ValueError, LookupError):
        command = summary_of(listed[0])["provenance"]["command"]
        others += [command[2]] * (Path(command[2]).name != Path(scene).name)
    return f"{out / 'study.csv'} is the table of another study, of {others[0]}; choose another folder by --out, or move it away" if others else ""


def no_figure(names, keys, scene):
    """What is wrong with names of figures of a scene; "" if nothing is. Names may also be those of other entries of summary.json and
    of `keys`."""
    try:
        found = tomllib.loads(Path(scene).read_text(encoding="utf-8"))
        tables = [of for name in ("material", "damage") for of in found.get(name, {}).items()]
        owners = {"BOUNDARY": [of["name"] for of in found.get("boundary", [])],
                  "PROBE": [of["name"] for of in found.get("probe", [])],
                  "MATERIAL": ["material", *(name for name, of in tables if isinstance(of, dict))]}
    except (OSError, ValueError, LookupError, TypeError, AttributeError):
        # The program says what is wrong.
        return ""
    listed = subprocess.run([os.environ["SIGNORINI"], "keys", "--figures"], capture_output=True, text=True).stdout
    known = [f"{owner}{point}{kind}" for first, point, kind in re.findall(r"^\| `(\w+)(\.?)(\w*)`", listed, re.MULTILINE)
             for owner in owners.get(first, [first])]
    for name in names:
        is_figure = any(name == of or name.startswith(f"{of}.") for of in known)
        if not is_figure and name.partition(".")[0] not in (*KINDS, *ENTRIES) and name not in keys:
            near = difflib.get_close_matches(name, known, 1)
            return f"{name} is no figure of {scene}; " + (
                f"did you mean {near[0]}?" if near else "`signorini keys --figures` lists all names")
    return ""


def own(out, pictures):
    """Makes the folder of a study with these `pictures`; returns its file `.locks`, open."""
    check_folder(out)
    out.mkdir(parents=True, exist_ok=True)
    for path in (out / ".locks", out / "study.csv", *pictures):
        check(path, is_of_study)
    return open(out / ".locks", "ab")


@contextmanager
def claim(locks, folder):
    """Locks a run against other studies until its end, or that of the process; false if another study has it. Where the
    file system has no locks, all runs are free."""
    place, is_free = zlib.crc32(folder.name.encode()), True
    try:
        fcntl.lockf(locks, fcntl.LOCK_EX | fcntl.LOCK_NB, 1, place)
    except OSError as error:
        is_free = error.errno not in (errno.EAGAIN, errno.EACCES)
    yield is_free
    with suppress(OSError):
        fcntl.lockf(locks, fcntl.LOCK_UN, 1, place)


@contextmanager
def servers(runs):
    """A server for each of the `runs` at once."""
    # Each run has a core of its own.
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "SIGNORINI_RUNS": str(runs)}
    idle = [Server(os.environ["SIGNORINI"], env=environment) for _ in range(runs)]
    yield idle
    for server in idle:
        server.close()


def run(command, idle, running):
    """Runs the program by one of the servers `idle`, which is meanwhile one of those `running`; returns the error, "" if there
    is none."""
    server = idle.pop()
    running.add(server)
    code, error = server.run(command)
    running.discard(server)
    idle.append(server)
    return error.strip() if code else ""


@contextmanager
def unread():
    """The reader of the output may go, as `| head` does: the study goes on without it."""
    try:
        yield
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def problem_of(arguments, command):
    """Why no run of the study can start; "" if they can. The program reads the options of the first one."""
    if arguments.jobs < 1:
        return "--jobs must be at least 1"
    scene = arguments.scene
    if scene.startswith(("/dev/", "/proc/")) or os.path.exists(scene) and not (os.path.isfile(scene) or os.path.isdir(scene)):
        return f"{scene}: it is a pipe or a device, and each run reads the scene again; save it in a file"
    cut = command.index("--") if "--" in command else len(command)
    asked = [os.environ["SIGNORINI"], *command[:cut], "--help"]
    tried = subprocess.run(asked, stdin=subprocess.DEVNULL, capture_output=True, text=True)
    return tried.stderr.removeprefix("error: ").strip() if tried.returncode else ""


@contextmanager
def stopping(pool, running):
    """On a signal no more runs start, and those that are running end behind their step."""
    try:
        yield
    except KeyboardInterrupt:
        pool.shutdown(wait=False, cancel_futures=True)
        for server in list(running):
            server.send_signal(signal.SIGINT)
        print("stopped; run the same command again to go on; `-- --restart` at its end also continues unfinished runs", file=sys.stderr)
        raise


def warn_of_columns(columns, folder):
    """Prints which columns the first complete run has not: others may have them, but a wrong name can be mended now."""
    for problem in unknown(columns, [summary_of(folder)]):
        print(f"warning: {problem.replace('no summary has', f'{folder.name} has no', 1)}", file=sys.stderr, flush=True)


def run_all(out, everything, inputs, jobs, columns, pictures):
    """Runs commands in their folders, except those that are complete; returns the errors by folder. The study draws `pictures`."""
    open_runs = [of for of in everything if not is_complete(*of, inputs)]
    done, failed, jobs = len(everything) - len(open_runs), {}, max(1, min(jobs, len(open_runs)))
    first = next((folder for folder, command in everything if (folder, command) not in open_runs), None)
    if first:
        warn_of_columns(columns, first)
    running = set()
    with unread():
        print(f"{len(everything)} runs{f', {done} of them complete' * bool(done)}", flush=True)

    def attempt(of):
        with claim(locks, of[0]) as is_free:
            return None if not is_free else "" if is_complete(*of, inputs) else run(of[1], idle, running)

    with own(out, pictures) as locks:
        while open_runs:
            later = {}
            with servers(jobs) as idle, ThreadPoolExecutor(jobs) as pool, stopping(pool, running):
                for k, error in enumerate(pool.map(attempt, open_runs)):
                    # Another study has it, or the memory may suffice for it alone, after the others.
                    if error is None or jobs > 1 and "not enough memory" in error:
                        later[k] = error
                        continue
                    done, folder = done + 1, open_runs[k][0]
                    failed.update({folder: error} if error else {})
                    with unread():
                        print(f"{done}/{len(everything)} {folder.name}{': ' + error if error else ''}", flush=True)
                    if not first and not error:
                        first = folder
                        warn_of_columns(columns, first)
            jobs = 1 if any(later.values()) else jobs
            time.sleep(len(later) == len(open_runs))
            open_runs = [open_runs[k] for k in later]
    return failed


def main(prog=None):
    """Returns the exit code: 1 if a run failed, 2 if its input is bad."""
    parser = argparse.ArgumentParser(
        prog=prog, description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", metavar="SCENE")
    parser.add_argument("--set", action="append", type=values_of, default=[], metavar="KEY=A,B,…",
                        help="values of a key; may be repeated")
    parser.add_argument("--cases", type=cases_of, default=([], [("", [])]), metavar="FILE.csv", help=(
        "a run for each row; with --set, one for each row and value"))
    parser.add_argument("--out", type=Path, metavar="DIR", help="default: out/SCENE-study")
    parser.add_argument("--jobs", type=int, default=len(os.sched_getaffinity(0)), help=(
        "runs at once (default: the cores that this process may use)"))
    parser.add_argument("--frames", action="store_true", help="with frames, as `run` writes them")
    parser.add_argument("--columns", type=names_of, action="extend", metavar=(
        "NAME,…"), help="of the table, as for `signorini table`")
    parser.add_argument("--plot", type=names_of, action="extend", default=[], metavar="NAME,…", help=(
        "figures to draw over the first varied value, with a curve for each of the others; numbers beside it as CSV"))
    words = sys.argv[1:]
    cut = words.index("--") if "--" in words else len(words)
    (arguments, others), more = parser.parse_known_args(words[:cut]), words[cut + 1:]
    if others:
        print(f"error: unrecognized arguments: {' '.join(others)}; options of `signorini run` follow --, as in "
              f"`-- {others[0]} …`", file=sys.stderr)
        return 2
    head, cases = arguments.cases
    keys = [key for key, _ in arguments.set]
    if twice := next((key for key in head + keys if (head + keys).count(key) > 1), None):
        print(f"error: --set {twice} is given twice; write all its values after one: {twice}=A,B,… or in a column of "
              "--cases", file=sys.stderr)
        return 2
    extra = [] if arguments.frames or "output.every" in head + keys else [("output.every", "0")]
    out = arguments.out or Path("out") / f"{Path(arguments.scene).stem}-study"
    products = [list(zip(keys, values)) for values in itertools.product(*(values for _, values in arguments.set))]
    chosen = [case + product for _, case in cases for product in products]
    # A label stands for the values of its row.
    named = [(label, product if label else case + product) for label, case in cases for product in products]
    folders = [out / name for name in names_for(named)]
    commands = [command_of(arguments.scene, folder, of + extra, more) for folder, of in zip(folders, chosen)]
    problem = problem_of(arguments, commands[0]) or other_study(out, folders, arguments.scene)
    if arguments.plot and not problem:
        problem = no_figure(arguments.plot, head + keys, arguments.scene)
    if problem:
        print(f"error: {problem}", file=sys.stderr)
        return 2
    pictures = []
    if arguments.plot:
        # matplotlib would follow a file matplotlibrc in the current folder, which can name programs.
        with chdir("/"):
            from study_pictures import drawn, paths_of
        pictures = [path for paths in paths_of(out, arguments.plot, ["png"]).values() for path in paths]
    columns = [name for name in arguments.columns or [] if name not in head + keys]
    failed = run_all(out, list(zip(folders, commands)), inputs_of(arguments.scene), arguments.jobs,
                     [*columns, *arguments.plot], pictures)
    summaries = [outcome(folder, failed.get(folder, "")) for folder in folders]
    rows, units = rows_of(folders, summaries, arguments.columns or columns_of(summaries), list(map(dict, chosen)))
    with whole(out / "study.csv", is_of_study) as part:
        write_table(rows, part, units)
    with unread():
        printed(rows, units)
        print(out / "study.csv", flush=True)
    is_refused = refused(columns, list(filter(None, summaries)))
    if arguments.plot:
        with unread():
            is_refused |= not drawn(folders, summaries, arguments.plot, out, settings=list(map(dict, chosen)))
    return 1 if failed else 2 if is_refused else 0


if __name__ == "__main__":
    sys.exit(main())
