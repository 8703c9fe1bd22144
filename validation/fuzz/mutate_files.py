"""Mutates files of meshes, scenes, profiles and results by chance, and runs what reads them.

No mutation may end in a traceback, a panic, or an answer that takes too long or too much memory. A mutation of a kind below
`LOUD` may besides not change the answer without a word: the answer is that of the file as it was, or a note is new, or the file
is refused. Mutations of a kind below `FREE` may change it, as a changed coordinate does.

    mutate_files.py [--count N] [--seed S] [--binary target/release/signorini] [--share 0.02]

Readers in Python run here; the program itself reads the share of the inputs that needs it, a process for each. The last lines
count the inputs by kind and by answer. Exit code 1: there are failures, whose inputs are in target/fuzz/files.
"""
import argparse
import contextlib
import importlib
import io
import json
import random
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
from collections import Counter
from functools import partial
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "scripts"))
SEEDS = Path(__file__).parent / "seeds" / "files"
MEMORY, SECONDS = 4 << 30, 60
SCENE = """[mesh]
file = "part.msh"
[material]
young = 1e6
poisson = 0.3
plane = "stress"
[time]
end = 1
step = 0.5
[[boundary]]
name = "bottom"
gap = 'spline("profile.csv", x)'
[[boundary]]
name = "77"
symmetry = true
[[boundary]]
name = "top"
traction = ["0", "-80*t"]
"""
PROFILE = "x,y\n-1,0.2\n0,0.1\n1,0.1\n2,0.3\n3,0.5\n"
CASES = "label,material.young,time.end\na,1e5,1\nb,,2\n\"c,d\",3e5,\n"
WORDS = ["0", "-1", "1e999", "nan", "99999999999999999999", "", "x", "1.D+0", "\0", "é", "-0", "1e-320", "*", "$", "{", "\t"]


def pieces(text):
    """The words of a text and the signs between them."""
    return re.split(r"([\s,;=<>'\"\[\](){}:]+)", text)


def any_line(random, lines):
    return random.randrange(len(lines)) if lines else 0


# Each mutation gets the lines of a file and its suffix and changes the lines; None: it does not apply there.
def drop(random, lines, suffix):
    del lines[any_line(random, lines)]


def twice(random, lines, suffix):
    at = any_line(random, lines)
    lines.insert(at, lines[at])


def swap(random, lines, suffix):
    a, b = any_line(random, lines), any_line(random, lines)
    lines[a], lines[b] = lines[b], lines[a]


def cut(random, lines, suffix):
    at = any_line(random, lines)
    lines[at] = lines[at][:random.randrange(len(lines[at]) + 1)]
    del lines[at + 1:]


def word(random, lines, suffix):
    at = any_line(random, lines)
    words = pieces(lines[at])
    words[2 * random.randrange((len(words) + 1) // 2)] = random.choice(WORDS)
    lines[at] = "".join(words)


def digit(random, lines, suffix):
    at = any_line(random, lines)
    digits = [i for i, sign in enumerate(lines[at]) if sign.isdigit()]
    if not digits:
        return "none"
    i = random.choice(digits)
    lines[at] = lines[at][:i] + str(random.randrange(10)) + lines[at][i + 1:]


def case(random, lines, suffix):
    at = any_line(random, lines)
    lines[at] = lines[at].swapcase()


def sign(random, lines, suffix):
    at = any_line(random, lines)
    i = random.randrange(len(lines[at]) + 1)
    lines[at] = lines[at][:i] + chr(random.choice([0, 9, 34, 37, 44, 92, 127, 233, 8232, 65279])) + lines[at][i + 1:]


FREE = [drop, twice, swap, cut, word, digit, case, sign]
KEYWORD = {".inp": r"\*[A-Za-z]", ".bdf": r"[A-Z]{3}"}
UNKNOWN = {".inp": ["*FROBNICATE", "*NMOVE, NSET=ALL", "1., 2., 3."], ".bdf": ["FROBNI,1,2,3"],
           ".msh": ["$Frobnicate", "1 2 3", "$EndFrobnicate"]}


def unknown(random, lines, suffix):
    """A keyword that nobody knows, before another keyword."""
    if suffix not in UNKNOWN:
        return "none"
    starts = r"\$(?!End)" if suffix == ".msh" else KEYWORD[suffix]
    places = [i for i, line in enumerate(lines) if re.match(starts, line) and i > 0]
    if not places:
        return "none"
    at = random.choice(places)
    # Data lines go with a keyword of Abaqus.
    lines[at:at] = UNKNOWN[suffix][:2 if suffix == ".inp" and random.random() < 0.5 else 1] if suffix != ".msh" else UNKNOWN[suffix]
    if suffix == ".inp" and random.random() < 0.5:
        lines.insert(at + 1, UNKNOWN[suffix][2])


def misspelt(random, lines, suffix):
    """A letter of a keyword or of the key of an option; not the first one of `*HEADING` and the like, whose lines are free."""
    if suffix not in KEYWORD:
        return "none"
    places = [i for i, line in enumerate(lines) if re.match(KEYWORD[suffix], line)]
    at = random.choice(places)
    keys = [m.span() for m in re.finditer(r"(?:^\*?|,\s*)[A-Za-z]{3,}(?=\s*(?:,|=|$))", lines[at])]
    if not keys:
        return "none"
    start, end = random.choice(keys)
    i = random.choice([i for i in range(start, end) if lines[at][i].isalpha()])
    lines[at] = lines[at][:i] + random.choice("QXZ") + lines[at][i + (random.random() < 0.7):]


def count(random, lines, suffix):
    """A count that the file does not keep."""
    heads = {".msh": r"\$(Nodes|Elements|NOD|ELM|ParametricNodes)$", ".vtk": r"(POINTS|CELLS|CELL_TYPES|CELL_DATA) ", ".vtu": "<Piece",
             ".xdmf": r"<Topology|<DataItem"}
    if suffix not in heads:
        return "none"
    places = [i for i, line in enumerate(lines) if re.match(heads[suffix], line)]
    if not places:
        return "none"
    at = random.choice(places) + (suffix == ".msh")
    numbers = [m for m in re.finditer(r"(?<![\w.-])\d+(?![\w.-])", lines[at])]
    if suffix == ".msh":
        # The range of the tags in 4.1 is for information.
        numbers = numbers[:2]
    if suffix == ".xdmf":
        # The precision of text is for information.
        numbers = [m for m in numbers if "Precision" not in lines[at][max(0, m.start() - 12):m.start()]]
    if not numbers:
        return "none"
    of = random.choice(numbers)
    value = max(0, int(of[0]) + random.choice([-2, -1, 1, 2]))
    if value == int(of[0]):
        return "none"
    lines[at] = lines[at][:of.start()] + str(value) + lines[at][of.end():]


def blocks(lines, suffix):
    """The lines that list nodes or elements."""
    keyword = ""
    for i, line in enumerate(lines):
        if suffix == ".inp":
            if line.startswith("*"):
                keyword = line.split(",")[0]
            elif keyword in ("*NODE", "*ELEMENT"):
                yield i
        elif suffix == ".bdf" and re.match("GRID|CTRIA3|CQUAD4", line):
            yield i


def other(random, lines, suffix):
    """A node or an element a second time, with other contents."""
    places = list(blocks(lines, suffix))
    if not places:
        return "none"
    words = lines[random.choice(places)].split(",")
    i = random.randrange(3 if suffix == ".bdf" and len(words) > 3 else 1, len(words))
    value = str(1 + random.randrange(9)) if "." not in words[i] else f"{random.randrange(1, 90) / 8}"
    if words[i].strip() == value or not words[i].strip():
        return "none"
    words[i] = value
    at = places[-1] if suffix == ".bdf" else random.choice([i for i in places if lines[i].count(",") == len(words) - 1])
    lines.insert(at + 1, ",".join(words))


def nothing(random, lines, suffix):
    """A label of an element or of a set that stands for nothing."""
    if suffix == ".inp":
        places = [i for i in range(len(lines)) if re.match(r"\*(ELEMENT|NSET|ELSET|SURFACE)", lines[i])]
        at = random.choice(places) + 1
        skip = int(lines[at - 1].startswith("*ELEMENT"))
        words = lines[at].split(",")
        if "GENERATE" in lines[at - 1]:
            return "none"
        words[random.randrange(skip, len(words) if not lines[at - 1].startswith("*SURFACE") else 1)] = "777"
    elif suffix == ".bdf":
        at = random.choice([i for i in range(len(lines)) if re.match("CTRIA3|CQUAD4", lines[i])])
        words = lines[at].split(",")
        words[random.randrange(3, len(words))] = "777"
    else:
        return "none"
    lines[at] = ",".join(words)


LOUD = [unknown, misspelt, count, other, nothing]


class TooLong(BaseException):
    pass


def late(number, frame):
    raise TooLong


def in_python(work):
    """(answer, said, failure) of a function that prints: the answer is None if it refuses."""
    out, err = io.StringIO(), io.StringIO()
    signal.alarm(SECONDS)
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            code = work()
        return (out.getvalue(), err.getvalue(), None) if not code else (None, err.getvalue() + str(code), None)
    except SystemExit as error:
        refused = isinstance(error.code, str) or error.code == 2
        return None, f"{error.code}", None if refused else f"exit {error.code}"
    except TooLong:
        return None, "", "too long"
    except MemoryError:
        return None, "", "memory"
    except Exception as error:
        return None, "", f"{type(error).__name__}: {error}"
    finally:
        signal.alarm(0)


def module(name, arguments):
    def work():
        sys.argv = [name, *map(str, arguments)]
        return importlib.import_module(name).main(name)
    return in_python(work)


def program(binary, arguments, folder):
    limit = lambda: resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    try:
        ran = subprocess.run([binary, *arguments], cwd=folder, capture_output=True, timeout=SECONDS, preexec_fn=limit)
    except subprocess.TimeoutExpired:
        return None, "", "too long"
    out, err = (text.decode(errors="replace") for text in (ran.stdout, ran.stderr))
    if ran.returncode not in (0, 1, 2) or "panicked" in err or "Traceback" in err:
        return None, err, f"exit {ran.returncode}: {err[-300:]}"
    return (out, err, None) if ran.returncode == 0 else (None, err, None)


def converted(path):
    """The mesh of a file without its notes, and the notes."""
    answer, said, failure = module("meshes.convert", [path])
    notes = re.findall(r"\$Comments\nnote .*\n\$EndComments\n", answer or "")
    for note in notes:
        answer = answer.replace(note, "")
    return answer, said + "".join(notes), failure


def inputs(folder, binary, share):
    """(name, lines, suffix, function from the path of a mutated file to its answer, share of the inputs)."""
    def lines_of(path):
        return path.read_text(encoding="latin-1").split("\n")

    for path in sorted(SEEDS.iterdir()):
        yield path.name, lines_of(path), path.suffix, converted, 1
    result = folder / "result"
    for path in sorted(result.glob("*")):
        if path.suffix == ".msh":
            continue
        readers = {"info": partial(module, "info", [result]), "table": partial(module, "table", [result]),
                   "states": partial(in_python, partial(states_of, result))}
        for name, read in readers.items():
            if name == "states" or path.name in ("summary.json", "fields.pvd"):
                yield f"{path.name} {name}", lines_of(path), f".{path.name}", partial(in_place, path, read), 1
    yield "cases.csv", CASES.split("\n"), ".csv", lambda path: in_python(partial(cases, path)), 1
    if binary:
        check = lambda *more: program(binary, ["check", "scene.toml", *more], folder)
        for version in ("plate-22", "plate-41", "version-1", "version-40", "quadrangles"):
            path = ROOT / f"tests/fixtures/msh/{version}.msh"
            yield path.name, lines_of(path), ".msh", lambda path: check("--set", f"mesh.file='{path.name}'"), share
        yield "scene.toml", SCENE.split("\n"), ".toml", lambda path: program(binary, ["check", path.name], folder), share
        yield "profile.csv", PROFILE.split("\n"), ".csv", lambda path: program(
            binary, ["check", "scene.toml", "--set", f"boundary.bottom.gap=spline('{path.name}', x)"], folder), share


def in_place(file, read, path):
    """What a reader says of a folder of results in which one file is replaced."""
    kept = file.read_bytes()
    try:
        shutil.copy(path, file)
        return read()
    finally:
        file.write_bytes(kept)


def states_of(result):
    """Prints what pictures show; returns the exit code."""
    reading, results = map(importlib.import_module, ("reading", "results"))
    for read in (reading._contact_rows, reading._orders):
        read.cache_clear()
    with results.telling(result) as problems:
        found = reading.read_results(result)
        for state in reading.states(found, found.frames):
            print(found.title, found.ending, state.moment, state.displacement.sum(), state.von_mises.sum(), state.zeta.sum(),
                  *(curve.pressure.sum() for curve in state.curves))
    return 2 if problems else 0


def cases(path):
    """Prints the runs of a study; returns the exit code."""
    try:
        print(importlib.import_module("study").cases_of(path))
    except argparse.ArgumentTypeError as error:
        print(error, file=sys.stderr)
        return 2


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=10000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--binary", type=Path)
    parser.add_argument("--share", type=float, default=0.02)
    arguments = parser.parse_args()
    signal.signal(signal.SIGALRM, late)
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    kept, counts, failures = ROOT / "target/fuzz/files", Counter(), []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "scene.toml").write_text(SCENE)
        (folder / "part.msh").write_bytes((ROOT / "tests/fixtures/msh/plate-22.msh").read_bytes())
        (folder / "profile.csv").write_text(PROFILE)
        if binary := arguments.binary and arguments.binary.resolve():
            _, said, failure = program(binary, ["run", "scene.toml", "--out", "result", "--set", "output.every=1"], folder)
            if said or failure:
                sys.exit(f"no results to mutate: {failure or said}")
        found = []
        for of, lines, suffix, read, share in inputs(folder, binary, arguments.share):
            path = folder / f"mutated{suffix}"
            path.write_text("\n".join(lines), encoding="latin-1")
            answer, said, failure = read(path)
            if failure or answer is None:
                print(f"left out: {of}: {failure or said.strip()}")
                continue
            found.append((of, lines, suffix, read, share, answer, said))
        for number in range(arguments.count):
            chance = random.Random(f"{arguments.seed} {number}")
            of, lines, suffix, read, _, answer, said = chance.choices(found, [share for *_, share, _, _ in found])[0]
            kind, mutated = chance.choice(FREE + LOUD if chance.random() < 0.5 else LOUD), list(lines)
            if kind(chance, mutated, suffix) == "none" or mutated == lines:
                kind, mutated = chance.choice(FREE), list(lines)
                kind(chance, mutated, suffix)
            path = folder / f"mutated{suffix}"
            path.write_text("\n".join(mutated), encoding="utf-8", errors="replace")
            other_answer, other_said, failure = read(path)
            if failure:
                verdict = "FAILED"
            elif other_answer is None:
                verdict = "refused"
            elif other_answer == answer:
                verdict = "same"
            elif other_said != said:
                verdict = "noted"
            else:
                verdict = "SILENT" if kind in LOUD else "changed"
            counts[kind.__name__, suffix, verdict] += 1
            if verdict in ("FAILED", "SILENT"):
                kept.mkdir(parents=True, exist_ok=True)
                (kept / f"{arguments.seed}-{number}{suffix}").write_bytes(path.read_bytes())
                failures.append(f"{verdict} {kind.__name__} {of} (target/fuzz/files/{arguments.seed}-{number}{suffix}): {failure or ''}")
    print(*failures[:60], sep="\n")
    verdicts = ["same", "noted", "refused", "changed", "SILENT", "FAILED"]
    for title, place in (("kind", 0), ("file", 1)):
        print(f"\n| {title} | inputs | {' | '.join(verdicts)} |\n|{'---|' * 8}")
        for name in sorted({key[place] for key in counts}):
            row = [sum(n for key, n in counts.items() if key[place] == name and key[2] == verdict) for verdict in verdicts]
            print(f"| {name} | {sum(row)} | {' | '.join(map(str, row))} |")
    print(f"\n{sum(counts.values())} inputs, {len(failures)} failures")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
