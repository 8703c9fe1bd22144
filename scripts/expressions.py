"""The expressions of a scene in x, y and t, as the solver reads them."""

import ast
import re

import numpy as np

NUMPY_FUNCTIONS = {
    "pi": np.pi, "sin": np.sin, "cos": np.cos, "tan": np.tan, "sqrt": np.sqrt, "exp": np.exp, "log": np.log,
    "abs": np.abs, "min": np.minimum, "max": np.maximum, "atan2": np.arctan2, "if_": np.where,
    "And": np.logical_and, "Or": np.logical_or,
}
ALLOWED = (
    ast.Expression, ast.BinOp, ast.UnaryOp, ast.Call, ast.Name, ast.Load, ast.Constant, ast.Add, ast.Sub, ast.Mult,
    ast.Div, ast.Pow, ast.USub, ast.UAdd, ast.Compare, ast.Lt, ast.LtE, ast.Gt, ast.GtE,
)


class ExpressionError(Exception):
    """The text is not an expression; the message has one line."""


class _Functions(ast.NodeTransformer):
    """Replaces `and` and `or` by functions, which work for fields, too."""

    def visit_BoolOp(self, node):
        self.generic_visit(node)
        name = ast.Name(type(node.op).__name__, ast.Load())
        first, *others = node.values
        for other in others:
            first = ast.Call(name, [first, other], [])
        return ast.fix_missing_locations(ast.copy_location(first, node))


class _Powers(ast.NodeTransformer):
    """Powers of numbers have floating point: those of whole numbers would grow until memory ends."""

    def visit_BinOp(self, node):
        self.generic_visit(node)
        if isinstance(node.op, ast.Pow) and isinstance(node.left, ast.Constant):
            node.left = ast.copy_location(ast.Constant(float(node.left.value)), node.left)
        return node


class Expression:
    """A formula in x, y, t, evaluated in whatever arithmetic the names are bound to.

    The same text gives values at points (NumPy) and variational forms (UFL). Tables are files in `folder`.
    """

    def __init__(self, text, folder=None):
        self.text, self.folder = str(text), folder
        try:
            # In Python the power is **, and `if` is not a function.
            text = re.sub(r"\bif\s*\(", "if_(", self.text.strip().replace("^", "**"))
            tree = _Powers().visit(_Functions().visit(ast.parse(text, mode="eval")))
            names = {*NUMPY_FUNCTIONS, "x", "y", "t", *(["table", "spline", "pchip"] if folder else [])}
            for node in ast.walk(tree):
                if not isinstance(node, ALLOWED):
                    raise ExpressionError(f"expression '{self.text}': {type(node).__name__} is not allowed")
                if isinstance(node, ast.Name) and node.id not in names:
                    raise ExpressionError(f"expression '{self.text}': unknown name '{node.id}'")
            self._code = compile(tree, self.text, "eval")
        except (SyntaxError, RecursionError, MemoryError) as error:
            raise ExpressionError(f"expression '{self.text}': {error}") from None

    def __call__(self, x, y, t, functions=NUMPY_FUNCTIONS):
        def points(name):
            if not (self.folder / name).is_file():
                raise ExpressionError(f"the table {name} is no file")
            rows = np.genfromtxt(self.folder / name, delimiter=",")
            return rows[~np.isnan(rows).any(axis=1)].T

        tables = {"table": lambda name, argument=t: np.interp(argument, *points(name)),
                  "spline": lambda name, argument=t: smooth(argument, *points(name), twice_differentiable),
                  "pchip": lambda name, argument=t: smooth(argument, *points(name), monotone)}
        return eval(self._code, {"__builtins__": {}}, {**functions, **tables, "x": x, "y": y, "t": t})

    def at(self, points, t=0.0):
        """Values at an (n, 2) array of points."""
        with np.errstate(all="ignore"):
            values = self(points[:, 0], points[:, 1], t)
        return np.broadcast_to(np.asarray(values, float), len(points)).copy()


def smooth(at, a, f, slopes):
    """The piecewise cubic function through points (a, f) with these slopes, constant beyond them; two points with the same a
    are a jump, which divides it."""
    values, first = np.full(np.shape(at), f[0], float), [0, *np.flatnonzero(np.diff(a) == 0.0) + 1]
    for i, j in zip(first, [*first[1:], len(a)]):
        values = np.where(at >= a[i], _without_jumps(np.clip(at, a[i], a[j - 1]), a[i:j], f[i:j], slopes), values)
    return values


def _without_jumps(at, a, f, slopes):
    if len(a) < 3:
        return np.interp(at, a, f)
    h, s = np.diff(a), np.diff(f) / np.diff(a)
    d = slopes(h, s)
    i = np.clip(np.searchsorted(a, at, side="right") - 1, 0, len(h) - 1)
    z, s, p, q = (at - a[i]) / h[i], s[i], d[i], d[i + 1]
    return f[i] + z * h[i] * (p + z * (3.0 * s - 2.0 * p - q + z * (p + q - 2.0 * s)))


def monotone(h, s):
    """The slopes of PCHIP, for intervals of lengths h with secant slopes s."""
    w, v = h[:-1] + 2.0 * h[1:], 2.0 * h[:-1] + h[1:]
    rises = s[:-1] * s[1:] > 0.0
    inner = (w + v) / (w / np.where(rises, s[:-1], 1.0) + v / np.where(rises, s[1:], 1.0)) * rises

    def end(i, j):
        return np.clip(s[i] + h[i] / (h[i] + h[j]) * (s[i] - s[j]), *sorted((0.0, 3.0 * s[i])))

    return np.array([end(0, 1), *inner, end(-1, -2)])


def twice_differentiable(h, s):
    """The slopes of the cubic spline whose first and last inner points are no knots; of three points those of a parabola."""
    n = len(h) + 1
    matrix, right, i = np.zeros((n, n)), np.zeros(n), np.arange(1, n - 1)
    matrix[i, i - 1], matrix[i, i], matrix[i, i + 1] = h[1:], 2.0 * (h[1:] + h[:-1]), h[:-1]
    right[1:-1] = 3.0 * (h[1:] * s[:-1] + h[:-1] * s[1:])
    for row, (near, i, j) in ((0, (1, 0, 1)), (n - 1, (n - 2, -1, -2))):
        parabola = n == 3
        matrix[row, row], matrix[row, near] = (1.0, 1.0) if parabola else (h[j], h[i] + h[j])
        right[row] = (2.0 * s[i] if parabola
                      else ((3.0 * h[i] + 2.0 * h[j]) * h[j] * s[i] + h[i] ** 2 * s[j]) / (h[i] + h[j]))
    return np.linalg.solve(matrix, right)


def with_values(scene, folder):
    """The scene with the values of its constants in place of their names, and with numbers in place of expressions in
    which no x, y or t is left."""
    values = {}

    def number(text):
        try:
            varies = re.search(r"\b([xyt]|table|spline|pchip)\b", text)
            return None if varies else float(Expression(text, folder)(0.0, 0.0, 0.0))
        except (ExpressionError, TypeError, ValueError, ArithmeticError, OSError):
            return None

    def replaced(value):
        if isinstance(value, dict):
            return {key: of if key in ("name", "plane", "mass") else replaced(of) for key, of in value.items()}
        if isinstance(value, list):
            return [replaced(of) for of in value]
        # Names of files stand in quotes.
        words = r"""("[^"]*"|'[^']*'|\b[^\W\d]\w*)"""
        text = re.sub(words, lambda word: values.get(word[0], word[0]), value) if isinstance(value, str) else value
        found = None if text == value else number(text)
        return text if found is None else found

    constants = scene.get("constants", {})
    # Each time at least one more gets its value.
    for name, written in [*constants.items()] * len(constants):
        found = number(str(replaced(written)))
        values.update({} if found is None else {name: f"({found!r})" if found < 0.0 else repr(found)})
    tables = ("boundary", "body", "damage", "material", "probe")
    return {name: replaced(table) if name in tables else table for name, table in scene.items()}


def evaluate(expression, points, t, folder):
    """The values of an expression or a number for pictures; 0 where they are not defined."""
    try:
        values = Expression(expression, folder).at(points, t)
    except (ExpressionError, TypeError, ValueError, ArithmeticError, OSError):
        return np.zeros(len(points))
    return np.where(np.isfinite(values), values, 0.0)
