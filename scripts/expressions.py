"""Evaluates the expressions of a scene for pictures: in x, y and t, as the solver reads them."""

import re

import numpy as np

NAMES = {
    "pi": np.pi, "sin": np.sin, "cos": np.cos, "tan": np.tan, "sqrt": np.sqrt, "exp": np.exp,
    "log": np.log, "abs": np.abs, "min": np.minimum, "max": np.maximum, "atan2": np.arctan2,
}
TOKEN = re.compile(r"(?P<number>(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?)|(?P<name>[A-Za-z_]\w*)|[-+*/^(),\s]")


def evaluate(expression, x, y, t):
    """The values of an expression, or of a number, at points x, y (arrays, m) and a time t, s; none
    where it uses what pictures do not know."""
    python, end = [], 0
    for token in TOKEN.finditer(str(expression)):
        if token.start() != end:
            return None
        end = token.end()
        # Every name is looked up in a table: the text can reach nothing else.
        if token["name"]:
            python.append(f"names[{token['name']!r}]")
        else:
            python.append(repr(float(token["number"])) if token["number"] else token[0])
    if end != len(str(expression)):
        return None
    names = {**NAMES, "x": x, "y": y, "t": t}
    try:
        with np.errstate(all="ignore"):
            value = eval("".join(python).replace("^", "**"), {"__builtins__": {}, "names": names})
            return np.nan_to_num(value + np.zeros_like(x), posinf=0.0, neginf=0.0)
    except (KeyError, TypeError, SyntaxError, ArithmeticError):
        return None
