"""Tables for LaTeX with booktabs and siunitx (version 3)."""

import re

# Characters with a meaning in LaTeX.
ESCAPES = {"\\": r"\textbackslash{}", "^": r"\textasciicircum{}", "~": r"\textasciitilde{}", "<": r"\textless{}",
           ">": r"\textgreater{}", "|": r"\textbar{}", '"': r"\char34{}",
           "[": "{[}", **{sign: f"\\{sign}" for sign in "{}$&#_%"}}
# Units that siunitx takes as they are written, once powers and products are in its form.
UNIT = re.compile(r"[A-Za-z]+[A-Za-z0-9./^]*")
NUMBER = r"-?\d+(?:\.\d+)?(?:e[+-]?\d+)?"
HEAD = "% In the preamble: \\usepackage{booktabs,siunitx}"


def escaped(text):
    """A text in which no character has a meaning for LaTeX."""
    return "".join(ESCAPES.get(letter, letter) for letter in text.encode(errors="replace").decode())


def number(text):
    """A text with its numbers as \\num: `5.3570 ± 0.0007`, `(1.40 ± 0.03)e-7`, `23000 singular`, or a plain one."""
    text = re.sub(r"e([+-]?)0*(\d)", lambda of: f"e{of[1].strip('+')}{of[2]}", text)
    if of := re.fullmatch(rf"\(({NUMBER}) ± ({NUMBER})\)e(-?\d+)", text):
        return rf"\num{{{of[1]} +- {of[2]} e{of[3]}}}"
    if of := re.fullmatch(rf"({NUMBER}) ± ({NUMBER})", text):
        # siunitx has one power of ten for a number and its uncertainty.
        return rf"\num{{{of[1]} +- {of[2]}}}" if "e" not in text else rf"$\num{{{of[1]}}} \pm \num{{{of[2]}}}$"
    value, space, rest = text.partition(" ")
    return rf"\num{{{value}}}{space}{escaped(rest)}" if re.fullmatch(NUMBER, value) else escaped(text)


def titled(name, unit):
    """The head of a column: a name and its unit."""
    plain = unit.replace("·", ".").replace("²", "^2").replace("³", "^3")
    shown = rf"\unit{{{plain}}}" if UNIT.fullmatch(plain) else escaped(unit)
    return escaped(name) + (f" ({shown})" if unit else "")


def tabular(heads, rows, left=1):
    """The lines of a table: `heads` and cells in LaTeX. The first `left` columns are aligned to the left."""
    lines = [" & ".join(row) + r" \\" for row in (heads, *rows)]
    columns = "l" * left + "r" * (len(heads) - left)
    return "\n".join([HEAD, r"{\sisetup{uncertainty-mode = separate}%", rf"\begin{{tabular}}{{{columns}}}", r"\toprule", lines[0],
                      r"\midrule", *lines[1:], r"\bottomrule", r"\end{tabular}}"])
