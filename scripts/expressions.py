"""Evaluates the expressions of a scene for pictures: in x, y and t, as the solver reads them."""

import math
import re

import numpy as np

NAMES = {
    "pi": math.pi, "sin": math.sin, "cos": math.cos, "tan": math.tan, "sqrt": math.sqrt,
    "exp": math.exp, "log": math.log, "abs": abs, "min": min, "max": max, "atan2": math.atan2,
    "if": lambda condition, a, b: a if condition else b,
}
TOKEN = re.compile(r'(?P<number>(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?)|(?P<name>[A-Za-z_]\w*)'
                   r'|(?P<text>"[^"\\]*")|[-+*/^(),<>=!\s]')


def evaluate(expression, points, t, folder):
    """The values of an expression, or of a number, at points (n, 2), m, and a time t, s; 0 where it
    is not defined, or is none that pictures know. Tables are in `folder`."""
    try:
        program = compile(_as_python(str(expression)), "expression", "eval")
    except (SyntaxError, RecursionError, MemoryError):
        return np.zeros(len(points))
    tables = {}

    def table(name, argument=t):
        if name not in tables:
            tables[name] = np.genfromtxt(folder / name, delimiter=",")
        rows = tables[name][~np.isnan(tables[name]).any(axis=1)]
        return np.interp(argument, *rows.T)

    def value(x, y):
        names = {**NAMES, "table": table, "x": x, "y": y, "t": t}
        try:
            value = float(eval(program, {"__builtins__": {}, "names": names}))
            return value if math.isfinite(value) else 0.0
        except (KeyError, TypeError, ValueError, ArithmeticError, OSError):
            return 0.0

    return np.array([value(x, y) for x, y in points.tolist()])


def _as_python(text):
    """The expression in Python's notation. Every name is looked up in a table: the text can reach
    nothing else."""
    python, end = [], 0
    for token in TOKEN.finditer(text):
        if token.start() != end:
            break
        end = token.end()
        if token["name"] in ("and", "or"):
            python.append(f" {token[0]} ")
        elif token["name"]:
            python.append(f"names[{token[0]!r}]")
        else:
            python.append(repr(float(token[0])) if token["number"] else token[0])
    if end != len(text):
        raise SyntaxError(text)
    return "".join(python).replace("^", "**").strip()
