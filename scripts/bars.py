"""Figures with their error bars, and places, as text."""

import re
from decimal import ROUND_CEILING, Decimal
from math import floor, log10

# A bar that is a smaller part of its figure is below the rounding of its digits.
ROUNDING = 1e-15
# The smallest bar that is shown, over its figure, and the digits of a value that do not come from rounding.
LEAST_BAR, DIGITS = 1e-6, 14


def plain(number, digits=3):
    """A figure without a bar: 1220, not 1.22e+03, and 2e-6."""
    return re.sub(r"e\+?(-?)0*", r"e\1", f"{float(f'{number:.{digits}g}'):.{max(digits, 7)}g}")


def placed(point, size):
    """A point as text, (x, y) or one coordinate: to a thousandth of the size of the body, wherever this is."""
    decimals = 3 - floor(log10(size))
    texts = [plain(float(f"{x + 0.0:.{max(decimals, 0)}f}") + 0.0, 12) for x in point]
    return f"({', '.join(texts)})" if len(texts) > 1 else texts[0]


def barred(value, bar):
    """`5.3570 ± 0.0005`: the bar rounded up to its first digit, or to its second where the first is 1 or 2, and the
    value to the same; `(1.4016 ± 0.0003)e-7` where decimals would be many, as on the screen. None without a bar."""
    if bar is None or bar <= ROUNDING * abs(value):
        return None
    if bar > abs(value) > 0:
        return f"{plain(value, 2)} ± {plain(bar, 2)}"
    bar = max(bar, LEAST_BAR * abs(value))
    value, bar = Decimal(f"{value:.{DIGITS}g}"), Decimal(repr(float(bar)))
    first = bar.adjusted()
    last = first - (bar.scaleb(-first) < 3)
    if value == 0:
        return f"0 ± {plain(bar.quantize(Decimal(1).scaleb(last), ROUND_CEILING))}"
    power = max(value, bar, key=abs).adjusted()
    power = 0 if -3 <= power <= 6 else power
    unit = Decimal(1).scaleb(last - power)
    # Adding 0 takes the sign from a zero.
    value = value.scaleb(-power).quantize(unit) + 0
    bar = bar.scaleb(-power).quantize(unit, ROUND_CEILING)
    text = f"{value:f} ± {bar:f}"
    return f"({text})e{power}" if power else text
