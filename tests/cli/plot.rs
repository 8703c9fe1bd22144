//! Pictures and reports, where there is a Python that draws them.

use crate::test_directory::{ProgramOutput, SCENE, TestDirectory, sets, square};
use std::fs::File;

#[test]
fn pictures_and_a_report_are_drawn_far_from_the_scripts() {
    let test_directory = TestDirectory::new();
    test_directory.run(&["--set", "output.every=5"]);
    let Some(drawn) =
        test_directory.say_python(&["plot", "out/scene", "--time", "0.45", "--format", "svg"])
    else {
        return;
    };
    assert_eq!(drawn.code, Some(0), "{drawn:?}");
    for picture in ["setting_t0.5.svg", "deformed_t0.5.svg", "pressure_t0.5.svg"] {
        assert!(test_directory.read(&format!("out/scene/{picture}")).contains("<svg"), "{picture}");
    }
    assert_eq!(test_directory.say(&["plot", "nothing"]).code, Some(2));
    // The old name of the command.
    let old = test_directory.say(&["figures", "out/scene", "--only", "setting"]);
    assert_eq!(old.code, Some(0), "{old:?}");
    assert!(
        old.err.contains("is now `signorini plot`") && old.out.contains("setting.png"),
        "{old:?}"
    );

    assert_eq!(test_directory.say(&["report", "out/scene", "--pdf"]).code, Some(0));
    let pdf = std::fs::read(test_directory.path("out/scene/report.pdf")).expect("a PDF");
    assert!(pdf.starts_with(b"%PDF") && pdf.len() > 20_000);
    assert_eq!(pdf.windows(12).filter(|of| of == b"/Type /Page ").count(), 1, "one page");
    let page = test_directory.read("out/scene/report.html");
    assert!(
        page.contains("small strains") && page.contains("without friction"),
        "no limits of the model"
    );
    assert!(page.contains("data:image/png;base64,") && page.contains("[[boundary]]"));
    let outside = ["src=\"http", "href=\"http", "<link", "@import", "$title"];
    assert!(outside.iter().all(|word| !page.contains(word)), "the page is not whole");

    let last = test_directory.frames("out/scene").pop().expect("a frame").1;
    let frame = format!("out/scene/{last}");
    test_directory.write(&frame, &test_directory.read(&frame)[..999]);
    let cut = format!("{frame}: it is damaged or cut off");
    test_directory.say(&["plot", "out/scene"]).fails(2, &[&cut]);
}

/// Without a folder for temporary files, without the packages, or where nothing can be written, every command that
/// Python does ends with one sentence.
#[test]
fn commands_of_python_in_odd_surroundings() {
    let directory = TestDirectory::new();
    directory.run(&[]);
    if directory.say_python(&["table", "out/scene"]).is_none() {
        return;
    }
    let said = |arguments: &[&str], variable: (&str, &str)| {
        ProgramOutput::of(directory.command(arguments).env(variable.0, variable.1))
    };
    for command in ["info", "table", "plot", "report", "study", "compare"] {
        let absent = said(&[command, "out/scene"], ("TMPDIR", "/absent"));
        absent.fails(1, &["/absent: No such file", "set TMPDIR to another folder"]);
        let absent = said(&[command, "out/scene"], ("PYTHON", "absent"));
        absent
            .fails(2, &["Python 3.11 or newer with matplotlib and meshio", "absent No such file"]);
    }
    directory.say(&["plot", "out/absent", "--together"]).fails(2, &["out/absent/summary.json"]);
    // No folder can be made below a file.
    for (command, more) in [("study", &["--set", "time.end=0.1"][..]), ("compare", &[])] {
        let said =
            directory.say(&[&[command, "scene.toml", "--out", "scene.toml/below"], more].concat());
        said.fails(2, &["scene.toml/below", "Not a directory"]);
        assert_eq!(said.err.lines().count(), 1, "{said:?}");
    }
    // Nothing can be written to this device.
    for command in ["info", "table"] {
        let full = File::create("/dev/full").expect("a device");
        let said = directory.command(&[command, "out/scene"]).stdout(full).output();
        let said = said.expect("the program starts");
        assert_eq!(said.status.code(), Some(2), "{said:?}");
        let err = String::from_utf8_lossy(&said.stderr);
        assert_eq!(err.trim_end(), "error: standard output: No space left on device", "{command}");
    }
}

#[test]
fn the_foundation_is_drawn_where_it_is_at_the_time_of_the_picture() {
    // A plate below that comes up by 0.01 in the run, and one at the right, which leaves the corner
    // (1, 0) opposite (1.2, −gap).
    let directory = TestDirectory::new();
    let plates = "boundary.bottom.gap='0.02 - 0.01*t'";
    let scene =
        format!("{}\n[[boundary]]\nname = \"right\"\ngap = 0.2\n", directory.read("scene.toml"));
    directory.write("plates.toml", &scene);
    directory.say(&["run", "plates.toml", "--set", plates, "--set", "output.every=5"]);
    let draws = "for time in (0.0, 0.5, 1.0):\n\
         \x20   results = read_results(Path('out/plates'), time)\n\
         \x20   points = sorted(p for line in results.foundation() for p in map(tuple, line.tolist()))\n\
         \x20   print(len(points), points[0], points[-1], points[4])";
    let Some(said) = python(&directory, draws) else { return };
    let expected = "9 (0.0, -0.02) (1.2, 1.0) (1.2, -0.02)\n\
                    9 (0.0, -0.015) (1.2, 1.0) (1.2, -0.015)\n\
                    9 (0.0, -0.01) (1.2, 1.0) (1.2, -0.01)\n";
    assert_eq!(said, expected);

    // Γ_C has a panel for each boundary, also where they meet.
    let panels = "from contact_pressure import draw_pressure\n\
         from limits import limits_of\n\
         results = read_results(Path('out/plates'))\n\
         figure = draw_pressure(results, limits_of([results]))\n\
         print([axes.get_title('left') for axes in figure.axes if axes.get_title('left')])\n\
         print([len(curve.points) for curve in results.curves])\n\
         print([bool(curve.pressure.any()) for curve in results.curves])";
    let said = python(&directory, panels).expect("as before");
    assert_eq!(said, "['bottom', 'right']\n[5, 5]\n[True, False]\n");
}

#[test]
fn a_hole_is_drawn_empty() {
    // The square without the two triangles of its middle cell.
    let directory = TestDirectory::new();
    let whole = square(3);
    let lines: Vec<&str> = whole.lines().collect();
    // Each triangle is a block of two lines.
    let is_cell = |line: &str| line.ends_with(" 6 7 11") || line.ends_with(" 6 11 10");
    let cell = |i: usize| is_cell(lines[i]) || lines.get(i + 1).is_some_and(|next| is_cell(next));
    assert_eq!((0..lines.len()).filter(|&i| cell(i)).count(), 4);
    let holed: Vec<&str> = (0..lines.len()).filter(|&i| !cell(i)).map(|i| lines[i]).collect();
    let holed = holed.join("\n").replace("Elements\n30 30", "Elements\n28 28") + "\n";
    directory.write("square.msh", &holed);
    directory.run(&["--set", "time.step=0.5"]);
    let draws = "import numpy as np\n\
         from setting import draw_setting\n\
         figure = draw_setting(read_results(Path('out/scene')), None)\n\
         figure.canvas.draw()\n\
         for point in ((0.5, 0.52), (0.5, 0.1), (0.1, 0.5)):\n\
         \x20   x, y = figure.axes[0].transData.transform(point).astype(int)\n\
         \x20   print(bytes(np.asarray(figure.canvas.buffer_rgba())[-1 - y, x, :3]).hex())";
    let Some(said) = python(&directory, draws) else { return };
    assert_eq!(said, "ffffff\nedf1f5\nedf1f5\n");
}

#[test]
fn a_body_without_damage_is_not_told_of_damage() {
    let directory = TestDirectory::new();
    let (elastic, damage) = SCENE.split_once("[damage]").expect("a table");
    let (_, rest) = damage.split_once("[time]").expect("a table");
    directory.write("scene.toml", &format!("{elastic}[time]{rest}"));
    let said = directory.run(&sets(&["time.step='auto'", "output.times=[0.5]"]));
    assert!(said.out.contains("to t = 1 in steps that follow the loads"), "{}", said.out);
    assert!(!said.out.contains('ζ'), "{}", said.out);
    let pressure = ["plot", "out/scene", "--animate", "--only", "pressure"];
    let Some(said) = directory.say_python(&pressure) else { return };
    assert_eq!(said.out, "out/scene/pressure.png\nout/scene/pressure.gif\n");
    let said = directory.say(&["plot", "out/scene", "--animate", "--only", "setting"]);
    let none = "--animate: --only has none of deformed, pressure, stress-damage; add one";
    assert!(said.code == Some(2) && said.err.contains(none), "{said:?}");
    directory.say(&["plot", "out/scene", "--animate"]);
    let names = directory.names("out/scene");
    assert!(names.iter().any(|name| name == "stress.gif"), "{names:?}");
    assert!(!names.iter().any(|name| name.starts_with("damage")), "{names:?}");
    // The next run removes it, and all else that was made of its results.
    let of_results =
        ["stress.gif", "report.pdf", "report.html", "pressure-together.svg", "curves_work.csv"];
    of_results.iter().for_each(|name| directory.write(&format!("out/scene/{name}"), ""));
    directory.run(&[]);
    assert!(!directory.names("out/scene").iter().any(|name| of_results.contains(&name.as_str())));
}

/// A block of some layers on some piers.
const PIERS: &str = r#"DefineConstant[ width = 6, height = 1, piers = 1, layers = 1, size = 0.25 ];
n = 2*piers - 1;
For k In {0:n}
  Point(k + 1) = {width*k/n, 0, 0, size};
EndFor
For k In {1:n}
  Line(k) = {k, k + 1};
EndFor
For k In {1:layers}
  Point(200 + 2*k) = {0, height*k/layers, 0, size};
  Point(201 + 2*k) = {width, height*k/layers, 0, size};
  Line(300 + k) = {201 + 2*k, 200 + 2*k};
  Line(400 + k) = {200 + 2*k, k == 1 ? 1 : 198 + 2*k};
  Line(500 + k) = {k == 1 ? n + 1 : 199 + 2*k, 201 + 2*k};
  If (k == 1)
    Curve Loop(k) = {1:n, 501, 301, 401};
  Else
    Curve Loop(k) = {-(299 + k), 500 + k, 300 + k, 400 + k};
  EndIf
  Plane Surface(k) = {k};
  Physical Surface(Sprintf("layer%g", k)) = {k};
EndFor
For k In {1:piers}
  Physical Curve(Sprintf("pier%g", k)) = {2*k - 1};
EndFor
Physical Curve("top") = {300 + layers};
Physical Curve("left") = {401:400 + layers};
"#;

/// Runs blocks from 1:6 to 6:1: a static one, one that breaks on ten piers, one that lifts off, one with a load that
/// comes and goes on quadratic elements, and one of three materials. Returns their folders.
fn blocks(directory: &TestDirectory) -> [&'static str; 5] {
    directory.write("piers.geo", PIERS);
    let damage =
        "[damage]\ndiffusion = 0.1\nlambda_d = 0.1\nlambda_u = 1e9\n[time]\nend = 1\nstep = 0.1\n";
    let quadratic = format!("[discretisation]\ndisplacement = 2\n{damage}");
    let cases = [
        ("tall", (1, 6, 1), "", "-4e5*x"),
        ("broken", (12, 2, 10), damage, "-4e6*t*x"),
        ("lifted", (5, 2, 1), damage, "1e5*(t - 0.5)"),
        ("pulsing", (6, 1, 1), &quadratic[..], "-4e5*sin(4*t)*x"),
        (
            "layered",
            (4, 3, 2),
            "[material.layer2]\nyoung = 5e9\n[material.layer3]\nyoung = 90e9\n",
            "-4e5*x",
        ),
    ];
    for (name, (width, height, piers), model, load) in cases {
        let layers = 1 + model.matches("[material.").count();
        let supports: String =
            (1..=piers).map(|k| format!("[[boundary]]\nname = \"pier{k}\"\ngap = 0\n")).collect();
        let scene = format!(
            "title = \"A block that is {name}\"\n[mesh]\nfile = \"piers.geo\"\n[mesh.parameters]\nwidth = {width}\n\
             height = {height}\npiers = {piers}\nlayers = {layers}\n[material]\nyoung = 30e9\npoisson = 0.2\nplane = \"strain\"\n\
             {model}{supports}[[boundary]]\nname = \"left\"\nsymmetry = true\n\
             [[boundary]]\nname = \"top\"\ntraction = [0, \"{load}\"]\n[[probe]]\nname = \"inside\"\npoint = [0.5, 0.5]\n"
        );
        directory.write(&format!("{name}.toml"), &scene);
        assert_eq!(directory.say(&["run", &format!("{name}.toml")]).code, Some(0), "{name}");
    }
    ["out/tall", "out/broken", "out/lifted", "out/pulsing", "out/layered"]
}

/// What a program beside this file prints, which gets the `folders`.
fn checked(directory: &TestDirectory, program: &str, folders: &[&str]) -> Option<String> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/cli/");
    python(directory, &format!("sys.argv[1:] = {folders:?}\nexec(open('{path}{program}').read())"))
}

#[test]
fn texts_of_pictures_do_not_overlap_and_reports_agree_with_the_history() {
    // Bodies of any shape. Every number of a report that is also in history.csv or summary.json is compared with it.
    let directory = TestDirectory::new();
    let folders = blocks(&directory);
    let Some(wrong) = checked(&directory, "pictures.py", &folders) else { return };
    assert_eq!(wrong, "");
    assert_eq!(directory.say(&[&["report"], &folders[..]].concat()).code, Some(0));
    let compared = checked(&directory, "reports.py", &folders).expect("as before");
    let counts: Option<Vec<usize>> = compared
        .strip_suffix(" points\n")
        .and_then(|text| text.split(" numbers ").map(|count| count.parse().ok()).collect());
    assert!(counts.is_some_and(|counts| counts.iter().all(|count| *count > 100)), "{compared}");
    // A run that ζ_* ended says so, and calls the state before by its name.
    let page = directory.read("out/broken/report.html");
    for text in ["<td>reached ζ_*</td>", "last state, before the stop", " ± "] {
        assert!(page.contains(text), "no `{text}`");
    }
}

#[test]
fn one_picture_and_the_forces_of_several_runs_are_drawn_alone() {
    let directory = TestDirectory::new();
    directory.run(&["--out", "out/one"]);
    directory.run(&["--out", "out/two", "--set", "material.young=160"]);
    let words = ["plot", "out/one", "--only", "pressure"];
    let Some(said) = directory.say_python(&words) else { return };
    assert_eq!(said.out, "out/one/pressure.png\n");
    let refused = directory.say(&["plot", "out/one", "--only", "pressur"]);
    assert!(
        refused.code == Some(2) && refused.err.contains("pressur is none of setting"),
        "{refused:?}"
    );
    let said = directory.say(&["plot", "out/one", "out/two", "--together", "--format", "svg"]);
    let together = "out/one/pressure-together.svg\nout/one/force-displacement-together.svg\n";
    assert_eq!(said.out, together);
    let refused = directory.say(&["plot", "out/one", "--together", "--only", "setting"]);
    refused.fails(2, &["--together draws pressure and force-displacement"]);
}

/// Static runs, also without frames, have pressures; without a foundation there is nothing to draw.
#[test]
fn static_runs_are_drawn_together() {
    let directory = TestDirectory::new();
    let (elastic, damage) = SCENE.split_once("[damage]").expect("a table");
    let (_, contact) = damage.split_once("[contact]").expect("a table");
    let scene = format!("{elastic}[contact]{contact}").replace("-3*t", "-3");
    directory.write("scene.toml", &scene);
    let words =
        ["study", "scene.toml", "--set", "boundary.top.traction=[0, -3],[0, '-6*x']", "--out"];
    let Some(said) = directory.say_python(&[&words[..], &["out/s"]].concat()) else { return };
    assert_eq!(said.code, Some(0), "{said:?}");
    let said = directory.say(&["plot", "out/s", "--together", "--format", "svg"]);
    assert!(said.code == Some(0) && said.out.ends_with("/pressure-together.svg\n"), "{said:?}");
    let clamped = scene.replace("gap = \"0\"", "displacement = [0, 0]");
    directory.write("scene.toml", &clamped);
    directory.run(&["--out", "out/clamped"]);
    let said = directory.say(&["plot", "out/clamped", "--together"]);
    said.fails(2, &["nothing to draw together"]);
}

/// The abscissa of the forces is the displacement of the boundary that drives the body, a clamp or a foundation, if there is one.
#[test]
fn forces_are_drawn_over_the_displacement_of_the_driven_boundary() {
    let directory = TestDirectory::new();
    let scene = directory.read("scene.toml");
    let clamp =
        scene.replace("traction = [\"0\", \"-3*t\"]", "displacement = [\"free\", \"-v*t\"]");
    let base = scene.replace("gap = \"0\"", "displacement = [\"free\", 0]");
    let plate = base.replace("traction = [\"0\", \"-3*t\"]", "gap = \"0.005 - v*t\"");
    for (name, scene) in [("load", &scene), ("clamp", &clamp), ("plate", &plate)] {
        let constants = if name == "load" { "" } else { "\n[constants]\nv = 0.01\n" };
        directory.write(&format!("{name}.toml"), &format!("{scene}{constants}"));
        let said = directory.say(&["run", &format!("{name}.toml"), "--set", "damage.lambda_u=0"]);
        assert_eq!(said.code, Some(0), "{said:?}");
    }
    let draws = "from histories import draw_forces\n\
         for name in ('load', 'clamp', 'plate'):\n\
         \x20   axes = draw_forces([read_results(Path('out') / name)], ['']).axes[0]\n\
         \x20   print(axes.get_xlabel().split(' (')[0], round(float(axes.lines[0].get_xdata()[-1]), 6))";
    let Some(said) = python(&directory, draws) else { return };
    let lines: Vec<&str> = said.lines().collect();
    assert!(lines[0].starts_with("largest displacement "), "{said}");
    assert_eq!(lines[1..], ["displacement of top 1.0", "displacement of top 1.0"]);
}

/// A run has a colour, and a support a style, also beyond the colours and styles of a short list.
#[test]
fn runs_have_colours_and_supports_styles() {
    let directory = TestDirectory::new();
    directory.run(&[]);
    let draws = "from histories import draw_forces\n\
         results = read_results(Path('out/scene'))\n\
         names = [f'run {k}' for k in range(12)]\n\
         lines = [line for line in draw_forces([results] * 12, names).axes[0].lines if 'run' in line.get_label()]\n\
         of = lambda line: line.get_label().split(', ')\n\
         colours, styles = {}, {}\n\
         for line in lines:\n\
         \x20   run, support = of(line)\n\
         \x20   colours.setdefault(run, set()).add(str(line.get_color()))\n\
         \x20   styles.setdefault(support, set()).add(line.get_linestyle())\n\
         print({len(c) for c in colours.values()}, len({str(c) for c in colours.values()}), {len(s) for s in styles.values()})";
    let Some(said) = python(&directory, draws) else { return };
    assert_eq!(said, "{1} 12 {1}\n");
}

/// A block that is pressed on its flat foundation and slides along it, magnified: the foundation stays, and every node that
/// touches it is on its line.
#[test]
fn a_flat_foundation_stays_at_its_place_under_a_magnified_body() {
    let directory = TestDirectory::new();
    let scene = directory
        .read("scene.toml")
        .replace("symmetry = true", "displacement = ['0.01*t', 'free']");
    directory.write("scene.toml", &scene);
    directory.run(&["--set", "damage.lambda_u=0"]);
    let draws = "import numpy as np\n\
         results = read_results(Path('out/scene'))\n\
         for factor in (1.0, 20.0):\n\
         \x20   line, = results.foundation(factor)\n\
         \x20   touching = results.places(factor)[(results.nodes[:, 1] == 0.0) & (results.gap == 0.0)]\n\
         \x20   print(line[:, 1].tolist() == [0.0] * len(line), line[:, 0].min(), len(touching),\n\
         \x20         touching[:, 0].max() <= line[:, 0].max() + 1.01 * results.displacement[:, 0].max())";
    let Some(said) = python(&directory, draws) else { return };
    assert_eq!(said, "True 0.0 5 True\nTrue 0.0 5 True\n");
}

/// A node of a curved foundation is drawn not farther from the node that touches it than this has slid, also where coordinates have
/// more than twelve decimals.
#[test]
fn a_magnified_body_touches_its_curved_foundation() {
    let directory = TestDirectory::new();
    directory.write("square.msh", &square(7));
    directory.run(&["--set", "boundary.bottom.gap='0.001*x^2'", "--set", "damage.lambda_u=0"]);
    let draws = "import numpy as np\n\
         results = read_results(Path('out/scene'))\n\
         line, = results.foundation(20.0)\n\
         touching = results.places(20.0)[(results.nodes[:, 1] == 0.0) & (results.gap == 0.0)]\n\
         far = np.linalg.norm(touching[:, None] - line, axis=2).min(axis=1)\n\
         print(len(line), len(touching), far.max() <= 1.001 * results.displacement[:, 0].max())";
    let Some(said) = python(&directory, draws) else { return };
    assert_eq!(said, "8 8 True\n");
}

/// The captions of a zoom are about the part that it shows, and its lines end where it ends.
#[test]
fn a_zoom_has_its_own_extremes() {
    let directory = TestDirectory::new();
    let scene = directory.read("scene.toml").replace("\"-3*t\"", "\"-3*t*x\"");
    directory.write("scene.toml", &scene);
    directory.run(&["--set", "discretisation.displacement=2"]);
    let draws = "import drawing, numpy as np\n\
         from limits import limits_of\n\
         from plot import PICTURES\n\
         zoom = [[0.0, 0.5], [0.5, 1.0]]\n\
         drawing.use(zoom=zoom)\n\
         results = read_results(Path('out/scene'), zoom=zoom)\n\
         x, y = results.places(results.factor).T\n\
         part = (x <= 0.5) & (x >= 0.0) & (y >= 0.5) & (y <= 1.0)\n\
         maps = PICTURES['stress-damage'](results, limits_of([results]))\n\
         largest = f'{results.von_mises[part].max():.3g}'\n\
         print(f'largest {largest}' in maps.axes[0].get_title('left'), results.von_mises[part].max() < 2.0)\n\
         lines = [of for axes in PICTURES['principal-stresses'](results, None).axes for of in axes.lines if len(of.get_xdata()) > 50]\n\
         print(len(lines) > 0, all(of.get_clip_box() is of.axes.bbox for of in lines))";
    let Some(said) = python(&directory, draws) else { return };
    assert_eq!(said, "True True\nTrue True\n");
}

/// Far from the origin a displacement is no rounding error, places have the digits of the body, and axes count from near.
#[test]
fn a_body_far_from_the_origin_has_displacements_and_places() {
    let directory = TestDirectory::new();
    let text = square(4);
    let (head, rest) = text.split_once("$Nodes").expect("nodes");
    let (nodes, tail) = rest.split_once("$EndNodes").expect("their end");
    let moved = nodes.lines().map(|line| match line.split(' ').collect::<Vec<_>>()[..] {
        [x, y, "0"] => format!("{} {y} 0\n", 1e6 + x.parse::<f64>().expect("a number")),
        _ => format!("{line}\n"),
    });
    let moved: String = moved.collect();
    directory.write("square.msh", &format!("{head}$Nodes{moved}$EndNodes{tail}"));
    directory.run(&["--set", "boundary.top.traction=[0, '-0.003*t*(x - 999999)']"]);
    let draws = "from drawing import along\n\
         from limits import limits_of\n\
         from maps import draw_deformed\n\
         from report import governing\n\
         results = read_results(Path('out/scene'))\n\
         print(draw_deformed(results, limits_of([results])).axes[0].get_xlabel())\n\
         print(along(results.curves[0].points, results.units)[1])\n\
         rows = {row[0]: row for row in governing(results)[0]}\n\
         print(float(rows['largest displacement'][1]) > 3e-5, '(1000001, 1)' in rows['largest displacement'])";
    let Some(said) = python(&directory, draws) else { return };
    let expected = "x − 1000000 (m)\nx − 1000000 (m) along y = 0\nTrue True\n";
    assert_eq!(said, expected);
    let places = ["table", "out/scene", "--columns", "bottom.contact_start_x,bottom.peak_x"];
    let said = directory.say(&places).out;
    assert!(said.contains(" 1000000 ") && said.contains(" 1000001 "), "{said}");
}

#[test]
fn maps_of_a_part_and_of_several_times_are_drawn_and_removed() {
    let directory = TestDirectory::new();
    directory.run(&["--set", "output.every=5"]);
    let zoom = ["plot", "out/scene", "--only", "stress-damage,pressure", "--zoom", "0,0,0.5,0.5"];
    let Some(said) = directory.say_python(&zoom) else { return };
    assert_eq!(said.out, "out/scene/stress-damage_zoom.png\nout/scene/pressure.png\n");
    let said = directory.say(&["plot", "out/scene", "--times", "0,0.5,1"]);
    assert_eq!(said.out, "out/scene/times.png\n");
    let said = directory.say(&["plot", "out/scene", "--zoom", "1,0,0,1"]);
    assert!(said.code == Some(2) && said.err.contains("X0 < X1"), "{said:?}");
    directory
        .say(&["plot", "out/scene", "--zoom", "10,10,12,12"])
        .fails(2, &["--zoom: the maps show nothing there; they are within"]);
    directory.say(&["plot", "out/scene", "--along", "bottom,top", "--quantity", "stress_yy"]);
    let rows = directory.read("out/scene/curves_along_bottom,top_stress_yy.csv");
    assert!(rows.starts_with("run,boundary,time (s),s (m),stress_yy (Pa)"), "{rows}");
    directory.run(&[]);
    assert!(!directory.names("out/scene").iter().any(|name| name.ends_with(".png")));
}

#[test]
fn curves_along_an_open_boundary_run_with_increasing_x_or_y() {
    let directory = TestDirectory::new();
    directory.run(&[]);
    let ends = "from signorini_results import load\n\
         for name in ('bottom', 'top', 'left'):\n\
         \x20   part, = load('out/scene').parts(name)\n\
         \x20   print(name, part[0].tolist(), part[-1].tolist())";
    let Some(said) = python(&directory, ends) else { return };
    assert_eq!(
        said,
        "bottom [0.0, 0.0] [1.0, 0.0]\ntop [0.0, 1.0] [1.0, 1.0]\nleft [0.0, 0.0] [0.0, 1.0]\n"
    );
    directory.say(&["plot", "out/scene", "--along", "top", "--format", "svg"]);
    let drawn = directory.read("out/scene/curves_along_top_von_mises.svg");
    assert!(drawn.contains("top: (0, 1) → (1, 1)"), "no direction");
}

#[test]
fn large_displacements_and_their_foundation_and_moving_loads_are_shown_where_they_are() {
    // A plate comes down by a fifth of the height, and a load walks along the top.
    let directory = TestDirectory::new();
    let scene = directory
        .read("scene.toml")
        .replace("name = \"left\"\nsymmetry = true", "name = \"bottom\"\ndisplacement = [0, 0]");
    let scene = scene
        .replace("name = \"bottom\"\ngap = \"0\"", "name = \"top\"\ngap = \"0.01 - 0.2*t\"")
        .replace(
            "name = \"top\"\ntraction = [\"0\", \"-3*t\"]",
            "name = \"right\"\ntraction = [\"if(abs(y - t) < 0.3, -1, 0)\", 0]",
        );
    directory.write("scene.toml", &scene);
    directory.run(&["--set", "output.every=1", "--set", "damage.lambda_u=0"]);
    let draws = "from limits import limits_of\n\
         from maps import draw_state, draw_stress_and_damage\n\
         from setting import draw_setting\n\
         from matplotlib.quiver import Quiver\n\
         results = read_results(Path('out/scene'))\n\
         limits = limits_of([results])\n\
         def plate(figure):\n\
         \x20   return sorted({round(float(line.get_ydata().max()), 6) for line in figure.axes[0].lines if len(line.get_xdata()) == 5 and line.get_linewidth() == 1.8})\n\
         print(results.factor, plate(draw_setting(results, limits)), plate(draw_stress_and_damage(results, limits)))\n\
         for time in (0.2, 0.8):\n\
         \x20   axes = draw_state(read_results(Path('out/scene'), time), limits).axes[0]\n\
         \x20   print([len(of.X) for of in axes.collections if isinstance(of, Quiver)], [round(float(of.Y.mean()), 1) for of in axes.collections if isinstance(of, Quiver) and len(of.X)])";
    let Some(said) = python(&directory, draws) else { return };
    assert_eq!(said, "1.0 [1.01] [0.81]\n[10, 0] [0.2]\n[10, 0] [0.7]\n");
}

/// What a Python program prints that has the scripts; none where Python lacks what these import.
#[track_caller]
fn python(directory: &TestDirectory, program: &str) -> Option<String> {
    let scripts = concat!(env!("CARGO_MANIFEST_DIR"), "/scripts");
    let program = format!(
        "import sys; sys.path.insert(0, '{scripts}')\n\
         from pathlib import Path\n\
         from reading import read_results\n\
         {program}"
    );
    let python = std::env::var("PYTHON").unwrap_or("/usr/bin/python3".to_owned());
    let said = std::process::Command::new(python)
        .args(["-c", &program])
        .current_dir(directory.path("."))
        .output()
        .expect("Python");
    let error = String::from_utf8_lossy(&said.stderr);
    if error.contains("No module named") {
        return None;
    }
    assert!(said.status.success(), "{error}");
    Some(String::from_utf8_lossy(&said.stdout).into_owned())
}
