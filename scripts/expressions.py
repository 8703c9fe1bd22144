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


class Expression:
    """A formula in x, y, t, evaluated in whatever arithmetic the names are bound to.

    The same text gives values at points (NumPy) and variational forms (UFL). Tables are files in `folder`.
    """

    def __init__(self, text, folder=None):
        self.text, self.folder = str(text), folder
        try:
            # In Python the power is **, and `if` is not a function.
            text = re.sub(r"\bif\s*\(", "if_(", self.text.strip().replace("^", "**"))
            tree = _Functions().visit(ast.parse(text, mode="eval"))
            names = {*NUMPY_FUNCTIONS, "x", "y", "t", *(["table"] if folder else [])}
            for node in ast.walk(tree):
                if not isinstance(node, ALLOWED):
                    raise ExpressionError(f"expression '{self.text}': {type(node).__name__} is not allowed")
                if isinstance(node, ast.Name) and node.id not in names:
                    raise ExpressionError(f"expression '{self.text}': unknown name '{node.id}'")
            self._code = compile(tree, self.text, "eval")
        except (SyntaxError, RecursionError, MemoryError) as error:
            raise ExpressionError(f"expression '{self.text}': {error}") from None

    def __call__(self, x, y, t, functions=NUMPY_FUNCTIONS):
        def table(name, argument=t):
            rows = np.genfromtxt(self.folder / name, delimiter=",")
            return np.interp(argument, *rows[~np.isnan(rows).any(axis=1)].T)

        return eval(self._code, {"__builtins__": {}}, {**functions, "table": table, "x": x, "y": y, "t": t})

    def at(self, points, t=0.0):
        """Values at an (n, 2) array of points."""
        with np.errstate(all="ignore"):
            values = self(points[:, 0], points[:, 1], t)
        return np.broadcast_to(np.asarray(values, float), len(points)).copy()


def evaluate(expression, points, t, folder):
    """The values of an expression or a number for pictures; 0 where they are not defined."""
    try:
        values = Expression(expression, folder).at(points, t)
    except (ExpressionError, TypeError, ValueError, ArithmeticError, OSError):
        return np.zeros(len(points))
    return np.where(np.isfinite(values), values, 0.0)
