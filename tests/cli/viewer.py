"""Looks at report.html in Chromium, and prints what is wrong with it; then the number of values that were compared. It
shares no code with the scripts: it reads the VTU by meshio. With --labels it looks at the places of labels only.

    viewer.py FOLDER [--labels]
"""

import csv
import sys
import time
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import meshio
import numpy as np
from selenium import webdriver
from selenium.webdriver.chrome.service import Service

# Pixels are whole numbers to the pointer.
MOVE = """
const canvas = document.querySelector("#viewer canvas"), box = canvas.getBoundingClientRect();
canvas.dispatchEvent(new PointerEvent("pointermove", {clientX: box.left + arguments[0], clientY: box.top + arguments[1]}));
return document.querySelector("#viewer .value").value"""
CLICK = """
const {view} = document.getElementById("viewer"), canvas = document.querySelector("#viewer canvas");
const box = canvas.getBoundingClientRect(), [x, y] = view.screen([arguments[0], arguments[1]]);
for (const kind of ["pointerdown", "pointerup"]) {
  canvas.dispatchEvent(new PointerEvent(kind, {clientX: box.left + x, clientY: box.top + y, pointerId: 1}));
}"""
SET = """
const control = document.querySelector(`#viewer [name=${arguments[0]}]`);
control.value = arguments[1];
control.dispatchEvent(new Event("input", {bubbles: true}))"""
# Of each field of the page: the array of the VTU, its column, and a function of the value.
FIELDS = {
    "damage": ("zeta", None, lambda zeta: 1.0 - zeta), "zeta": ("zeta", None, None), "von_mises": ("von_mises", None, None),
    "stress_1": ("principal_stress", 0, None), "stress_2": ("principal_stress", 1, None), "stress_xx": ("stress", 0, None),
    "stress_yy": ("stress", 1, None), "stress_xy": ("stress", 2, None), "stress_zz": ("stress", 3, None),
    "u_x": ("displacement", 0, None), "u_y": ("displacement", 1, None),
}


# Figures of history.csv that are extremes of a field over the nodes.
EXTREMES = {
    "zeta_min": ("zeta", "least"), "displacement_max": ("displacement", "largest"), "von_mises_max": ("von_mises", "largest"),
    "principal_max": ("stress_1", "largest"), "principal_min": ("stress_2", "least"),
}
# The boxes of the texts of the picture, the colour bar and the picture, pixels; texts of the bar come last.
BOXES = """
const box = of => { const {left, top, right, bottom} = of.getBoundingClientRect(); return [left, top, right, bottom]; };
const all = [...document.querySelectorAll("#viewer .picture text")], isOfBar = of => Boolean(of.closest(".bar"));
return {names: all.map(of => of.textContent), texts: all.map(box), ofBar: all.map(isOfBar),
        bar: box(document.querySelector("#viewer .bar")), picture: box(document.querySelector("#viewer .picture"))}"""

# After a change the picture is drawn before the next repaint.
DRAWN = """
let left = 4;
const again = () => { left--; left ? requestAnimationFrame(again) : arguments[0](); };
again()"""


def browser():
    options = webdriver.ChromeOptions()
    options.binary_location = "/usr/bin/chromium"
    for flag in ("--headless=new", "--no-sandbox", "--window-size=1200,1000", "--use-angle=swiftshader",
                 "--enable-unsafe-swiftshader"):
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    return webdriver.Chrome(service=Service("/usr/bin/chromedriver"), options=options)


def value_at(page, view, x, y):
    """What the page says of a point of the undeformed body."""
    page.execute_script(SET, "factor", "0")
    origin = view["origin"]
    pixel = page.execute_script("return document.getElementById('viewer').view.screen(arguments[0])",
                                [x - origin[0], y - origin[1]])
    return page.execute_script(MOVE, *pixel)


def expected(mesh, field, x, y):
    """The linear or quadratic interpolant of a field of the VTU at a point."""
    name, column, of = FIELDS[field]
    values = mesh.point_data[name].astype(float)
    values = values if column is None else values[:, column]
    values = values if of is None else of(values)
    for element in mesh.cells[0].data:
        (ax, ay), (bx, by), (cx, cy) = mesh.points[element[:3], :2]
        area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
        b, c = ((x - ax) * (cy - ay) - (cx - ax) * (y - ay)) / area, ((bx - ax) * (y - ay) - (x - ax) * (by - ay)) / area
        a = 1.0 - b - c
        if min(a, b, c) >= -1e-9:
            weights = [a, b, c] if len(element) == 3 else [
                a * (2 * a - 1), b * (2 * b - 1), c * (2 * c - 1), 4 * a * b, 4 * b * c, 4 * c * a]
            # Differences of stresses are as exact as these.
            size = np.abs(mesh.point_data["stress"] if "stress" in name or name == "von_mises" else values).max()
            return float(np.dot(weights, values[element])), size
    return None, None


def curve(page, view, mesh, random):
    """Draws a line between two elements with two clicks, and compares three values of its curve; returns their number."""
    page.execute_script(SET, "factor", "0")
    page.execute_script(SET, "field", "u_y")
    page.execute_script("document.querySelector('#viewer [data-action=line]').click()")
    for element in random.choice(mesh.cells[0].data, 2, replace=False):
        place = mesh.points[element[:3], :2].mean(axis=0) - view["origin"]
        page.execute_script(CLICK, *place)
    data = page.execute_script("const {view} = document.getElementById('viewer');"
                               "return [view.cut.map(of => of.at), view.lineData()[1]]")
    for k in (0, 100, 400):
        x, y = np.array(data[0][k]) + view["origin"]
        exact, largest = expected(mesh, "u_y", x, y)
        if exact is not None and abs(data[1][k] - exact) > 2e-5 * largest + 1e-12:
            print(f"u_y on the line at ({x}, {y}): {data[1][k]}, but {exact}")
    if [len(of) for of in data] != [401, 401]:
        print("the line has no curve")
    return 3


def labels(page, folder):
    """No text of the picture lies over another one, the colour bar or the edge; returns the number of texts."""
    count = 0
    page.execute_script("document.querySelectorAll('#viewer [type=checkbox]').forEach(of => { of.checked = true; })")
    fields = page.execute_script("return Object.keys(document.getElementById('viewer').view.run.fields)")
    for width, height in ((360, 640), (800, 600), (1400, 1000)):
        # Windows have a least width.
        page.execute_cdp_cmd("Emulation.setDeviceMetricsOverride",
                             {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False})
        for field in fields:
            for factor in ("1", "2000"):
                page.execute_script(SET, "factor", factor)
                page.execute_script(SET, "field", field)
                page.execute_async_script(DRAWN)
                found = page.execute_script(BOXES)
                names, texts, (left, top, right, bottom) = found["names"], found["texts"], found["picture"]
                count += sum(map(bool, names))
                here = f"{folder.name}, {field} × {factor}, {width} pixels"
                for k, (name, box) in enumerate(zip(names, texts)):
                    if name and not (left <= box[0] and top <= box[1] and box[2] <= right and box[3] <= bottom):
                        print(f"{here}: {name} is cut off")
                    others = list(zip(names, texts))[k + 1:] + [("the colour bar", found["bar"])] * (not found["ofBar"][k])
                    for other, of in others:
                        # Boxes of the browser have rounded edges.
                        if name and other and min(box[2], of[2]) - max(box[0], of[0]) > 0.5 and min(
                                box[3], of[3]) - max(box[1], of[1]) > 0.5:
                            print(f"{here}: {name} lies over {other}")
                if factor == "1" and not any(of.startswith(("min", "max")) for of in names):
                    print(f"{here}: no extreme has a label")
    return count


def with_history(page, folder, frame, moment):
    """The extremes of the fields of a frame are those of history.csv, and the curves of Γ_C those of contact.csv; returns the
    number of compared values."""
    with open(folder / "history.csv", newline="") as file:
        row = next(of for of in csv.DictReader(file) if abs(float(of["time"]) - moment) <= 1e-9)
    found = page.execute_script("""
        const {run} = document.getElementById("viewer").view, found = {};
        for (const [name, [field, end]] of Object.entries(arguments[0])) {
          found[name] = run.fields[field] ? run.extremes(field, arguments[1], -1)[end].value : null;
        }
        const pressures = run.frames[arguments[1]].contact.flatMap(of => [...of.pressure]);
        return {...found, pressure_max: Math.max(...pressures)}""", EXTREMES, frame)
    for name, value in found.items():
        exact, size = float(row[name]), max(abs(float(row[other])) for other in (name, "von_mises_max" if "principal" in name else name))
        if value is not None and abs(value - exact) > 2e-5 * size + 1e-12:
            print(f"{name} in frame {frame}: {value}, but {exact} in history.csv")
    factor, drawn = page.execute_script("""
        const {view} = document.getElementById("viewer");
        return [view.run.units.stress.factor, view.contact.map(of => of.plot.data.map(column => [...column]))]""")
    with open(folder / "contact.csv", newline="") as file:
        rows = [of for of in csv.DictReader(file) if abs(float(of["time"]) - moment) <= 1e-9]
    exact = np.array([[float(of[name]) for name in ("arc_length", "pressure", "gap")] for of in rows])
    curves = np.hstack([np.array(of) for of in drawn]).T * (1.0, factor, 1.0)
    if curves.shape != exact.shape or np.any(np.abs(curves - exact) > 2e-5 * np.abs(exact).max(axis=0) + 1e-12):
        print(f"the curves along the foundation in frame {frame} are not those of contact.csv")
    return len(found) + exact.size


def main(folder, only_labels):
    page, compared = browser(), 0
    frames = [(float(of.get("timestep")), folder / of.get("file"))
              for of in ElementTree.parse(folder / "fields.pvd").iter("DataSet")]
    try:
        page.get((folder / "report.html").resolve().as_uri())
        deadline = time.monotonic() + 60.0
        while not page.execute_script("return Boolean(document.getElementById('viewer').view)"):
            if time.monotonic() > deadline:
                sys.exit("no picture: " + page.execute_script("return document.querySelector('.hint').value"))
            time.sleep(0.05)
        if only_labels:
            print(labels(page, folder))
            return
        view = page.execute_script("const {run} = document.getElementById('viewer').view;"
                                   "return {origin: run.origin, fields: Object.keys(run.fields), factor: run.units.stress.factor}")
        if page.execute_script("return document.querySelector('#viewer [name=frame]').max") != str(len(frames) - 1):
            print("not all frames are in the page")
        random = np.random.default_rng(1)
        for frame in {0, len(frames) // 2, len(frames) - 1}:
            mesh = meshio.read(frames[frame][1])
            page.execute_script(SET, "frame", str(frame))
            moment = page.execute_script("return document.querySelector('#viewer .moment').value")
            if f"{frames[frame][0]:g}" not in moment:
                print(f"frame {frame} at {frames[frame][0]} is called {moment!r}")
            compared += with_history(page, folder, frame, frames[frame][0])
            for field in view["fields"]:
                if field not in FIELDS:
                    continue
                page.execute_script(SET, "field", field)
                for _ in range(10):
                    # A point of a random element, on a whole pixel or not.
                    corners = mesh.points[random.choice(mesh.cells[0].data)[:3], :2]
                    x, y = random.dirichlet((2.0, 2.0, 2.0)) @ corners
                    said = value_at(page, view, x, y)
                    exact, largest = expected(mesh, field, x, y)
                    if not said:
                        print(f"{field} at ({x}, {y}): the page says nothing")
                        continue
                    place = np.array([float(of) for of in said[1:said.index(")")].split(",")])
                    label = page.execute_script("return document.getElementById('viewer').view.unit.label")
                    value = float(said.split(label, 1)[1].split()[0].rstrip(",;"))
                    value *= view["factor"] if "stress" in FIELDS[field][0] or field == "von_mises" else 1.0
                    size = np.ptp(mesh.points[:, :2], axis=0).max()
                    if abs(value - exact) > 2e-5 * largest or np.abs(place - (x, y)).max() > 2e-5 * size:
                        print(f"{field} at ({x}, {y}) in frame {frame}: {said!r}, but {exact}")
                    compared += 1
        # The range by hand holds until another one is chosen; that of one time is not wider than that of all times.
        ends = "return ['low', 'high'].map(name => document.querySelector(`#viewer [name=${name}]`).valueAsNumber)"
        shown = "const {low, high} = document.getElementById('viewer').view.range; return [low, high]"
        page.execute_script(SET, "field", "u_y")
        of_run = page.execute_script(ends)
        page.execute_script(SET, "range", "frame")
        of_frame = page.execute_script(ends)
        if not of_run[0] - 1e-9 <= of_frame[0] <= of_frame[1] <= of_run[1] + 1e-9:
            print(f"range {of_frame} of one time is not in {of_run}")
        page.execute_script(SET, "high", "3")
        page.execute_script(SET, "low", "1")
        page.execute_script(SET, "frame", "0")
        if page.execute_script(shown) != [1, 3]:
            print(f"the range by hand is {page.execute_script(shown)}")
        # A factor that is not used is said to be none.
        for factor, said in (("1e12", True), ("-1", True), ("3", False)):
            page.execute_script(SET, "factor", factor)
            if ("multiplied by" in page.execute_script("return document.querySelector('.hint').value")) != said:
                print(f"the factor {factor} is {'not ' * said}said to be left out")
        compared += curve(page, view, meshio.read(frames[0][1]), random)
        # With everything on, the picture is valid SVG.
        page.execute_script("document.querySelectorAll('#viewer [type=checkbox]').forEach(of => { of.checked = true; })")
        page.execute_script(SET, "factor", "2")
        time.sleep(0.3)
        ElementTree.fromstring(page.execute_script("return document.getElementById('viewer').view.picture()"))
        for name in page.execute_script("return performance.getEntriesByType('resource').map(of => of.name)"):
            if not name.startswith(("data:", "blob:")):
                print(f"the page has fetched {name}")
        for line in page.get_log("browser"):
            print(f"the browser says {line['message']}")
        for width in (360, 794, 1400):
            page.set_window_size(width, 1000)
            wide = page.execute_script("return document.documentElement.scrollWidth - window.innerWidth")
            if wide > 0:
                print(f"the page is {wide} pixels wider than {width}")
        print(compared)
    finally:
        page.quit()


main(Path(sys.argv[1]), "--labels" in sys.argv)
