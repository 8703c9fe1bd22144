//! `signorini study`, `table`, curves of `figures`, and the Python module that reads results.

use crate::test_directory::TestDirectory;
use std::process::Command;

#[test]
fn a_study_runs_all_combinations_once_and_tells_their_figures() {
    let directory = TestDirectory::new();
    let words = ["study", "scene.toml", "--set", "material.young=80,160", "--set"];
    let words = [&words[..], &["boundary.top.traction=[0, -1],[0, -3]", "--out", "out/s"]].concat();
    let Some(said) = directory.say_python(&words) else { return };
    assert_eq!(said.code, Some(0), "{said:?}");
    assert!(said.out.starts_with("4 runs\n"), "{}", said.out);
    let table = directory.read("out/s/study.csv");
    let rows: Vec<_> = table.lines().map(|line| line.trim_end()).collect();
    assert_eq!(rows.len(), 5, "{table}");
    assert!(rows[0].starts_with("run,material.young,boundary.top.traction,end_time"), "{table}");
    // No frames, but the last state of Γ_C.
    let folder = "out/s/young=80__traction=_0_-1_";
    let folder =
        directory.names("out/s").into_iter().find(|n| n.starts_with("young=80")).expect(folder);
    let names = directory.names(&format!("out/s/{folder}"));
    assert!(!names.iter().any(|name| name.starts_with("fields")), "{names:?}");
    assert_eq!(directory.read(&format!("out/s/{folder}/contact.csv")).lines().count(), 6);

    let refused = directory.say(&["study", "scene.toml", "--accuracy", "0.1"]);
    refused.fails(2, &["unrecognized arguments: --accuracy", "as in `-- --accuracy"]);

    // Nothing is repeated but what is missing.
    directory.write(&format!("out/s/{folder}/summary.json"), "{");
    let again = directory.say(&words);
    assert!(again.out.starts_with("4 runs, 3 of them complete"), "{}", again.out);
    assert_eq!(again.out.lines().filter(|line| line.starts_with("4/4")).count(), 1);

    // A changed scene is run again.
    directory.write("scene.toml", &(directory.read("scene.toml") + "\n"));
    let changed = directory.say(&words);
    assert!(changed.out.starts_with("4 runs\n"), "{}", changed.out);

    let all = ["table", &format!("out/s/{folder}"), "out/s/nothing"].map(str::to_owned);
    let words: Vec<_> = all.iter().map(String::as_str).collect();
    directory.say(&words).fails(2, &["out/s/nothing/summary.json: No such file"]);
}

/// Runs are repeated when a table or a part of the geometry has changed, not only the scene itself.
#[test]
fn a_study_sees_changes_of_all_files_that_a_scene_reads() {
    let directory = TestDirectory::new();
    let text = directory.read("scene.toml").replace("-3*t", r#"-table(\"load.csv\", t)"#);
    assert!(text.contains("load.csv"), "{text}");
    directory.write("scene.toml", &(text + "# as if of \"body.geo\"\n"));
    directory.write("body.geo", "Include \"part.geo\";\n");
    directory.write("part.geo", "");
    directory.write("load.csv", "0,0\n1,3\n");
    let words = ["study", "scene.toml", "--set", "material.young=80,160", "--out", "out/s"];
    let Some(said) = directory.say_python(&words) else { return };
    assert_eq!(said.code, Some(0), "{said:?}");
    assert!(directory.say(&words).out.starts_with("2 runs, 2 of them complete"));
    let before = directory.read("out/s/study.csv");
    directory.write("load.csv", "0,0\n1,2\n");
    assert!(directory.say(&words).out.starts_with("2 runs\n"));
    assert_ne!(directory.read("out/s/study.csv"), before);
    directory.write("part.geo", "// changed\n");
    assert!(directory.say(&words).out.starts_with("2 runs\n"));
    assert!(directory.say(&words).out.starts_with("2 runs, 2 of them complete"));
}

/// A study of constants: their names are keys and columns, runs are called after their values or their labels, and the
/// scene as run keeps them.
#[test]
fn a_study_varies_constants_and_cases_have_labels() {
    let directory = TestDirectory::new();
    let text = directory
        .read("scene.toml")
        .replace("-3*t", "-load*t")
        .replace("young = 80", "young = '8*E'");
    let text = text
        + "\n[constants]\nload = '2*v'\nv = 1\nE = 10\n[[probe]]\nname = 'p'\npoint = ['v/4', 0.5]\n";
    directory.write("scene.toml", &text);
    let study_in = |out: &str, words: &[&str]| {
        let words =
            [&["study", "scene.toml", "--columns", "displacement_max", "--out", out], words]
                .concat();
        directory.say_python(&words)
    };
    let study = |words: &[&str]| study_in("out/s", words);
    let Some(said) = study(&["--set", "v=1,2", "--set", "constants.E=10"]) else { return };
    assert_eq!(said.code, Some(0), "{said:?}");
    let rows_in = |out: &str| {
        let table = directory.read(&format!("{out}/study.csv"));
        let head = table.lines().next().expect("a head").to_owned();
        let cells = table.lines().skip(1).map(|row| row.split(',').map(str::to_owned).collect());
        (head, cells.collect::<Vec<Vec<String>>>())
    };
    let (head, cells) = rows_in("out/s");
    assert!(head.starts_with("run,v,displacement_max"), "{head}");
    // The axis of a picture says that the key is a constant.
    let figure = ["plot", "out/s", "--figure", "displacement_max", "--format", "svg"];
    assert_eq!(directory.say(&figure).code, Some(0));
    let picture = directory.read("out/s/curves_displacement_max.svg");
    assert!(picture.contains("over constant v"), "no name of the axis");
    assert_eq!([&cells[0][0], &cells[1][0]], ["v=1__E=10", "v=2__E=10"]);
    // A wrong column is named as soon as there is a run, and again at the end.
    let wrong = ["--set", "v=1,2", "--set", "constants.E=10", "--columns", "displacment_max"];
    let said = study(&wrong).expect("Python");
    let told = said.err.find("has no displacment_max; did you mean").expect("a warning");
    let again = said.err.find("error: no summary has displacment_max").expect("an error");
    assert!(said.code == Some(2) && told < again, "{said:?}");
    let u = |row: &[String], k: usize| row[k].parse::<f64>().expect("a number");
    assert!((u(&cells[1], 2) / u(&cells[0], 2) - 2.0).abs() < 0.05, "{cells:?}");
    // The scene as run keeps the constants, for another run and for pictures.
    let again =
        directory.say(&["run", "out/s/v=1__E=10/scene.toml", "--set", "v=2", "--out", "out/again"]);
    assert_eq!(again.code, Some(0), "{again:?}");
    let figure =
        |folder: &str| directory.summary(folder)["figures"]["displacement_max"]["value"].clone();
    assert_eq!(figure("out/again"), figure("out/s/v=2__E=10"));
    directory.run(&["--set", "output.every=1"]);
    let report = directory.say(&["report", "out/scene"]);
    assert_eq!(report.code, Some(0), "{report:?}");
    let page = directory.read("out/scene/report.html");
    assert!(page.contains("E = 80 Pa"), "the value, not the name");

    directory.write("cases.csv", "label,v,constants.E\nsoft one,,5\nstiff,2,\n");
    // The table of another study is not replaced.
    let before = directory.read("out/s/study.csv");
    let refused = study(&["--cases", "cases.csv"]).expect("Python");
    refused.fails(2, &["out/s/study.csv is the table of another study, of v=1__E=10; choose"]);
    assert_eq!(directory.read("out/s/study.csv"), before);
    let said = study_in("out/cases", &["--cases", "cases.csv"]).expect("Python");
    assert_eq!(said.code, Some(0), "{said:?}");
    let (head, cells) = rows_in("out/cases");
    assert!(head.starts_with("run,constants.E,v,displacement_max"), "{head}");
    assert_eq!([&cells[0][0], &cells[1][0]], ["soft_one", "stiff"]);
    let steps = ["--cases", "cases.csv", "--set", "time.step=0.5,1"];
    let said = study_in("out/steps", &steps).expect("Python");
    assert!(said.code == Some(0) && said.out.contains("stiff__step=0.5"), "{said:?}");
    directory.write("cases.csv", "label,v\nsoft,1\nsoft,2\n");
    let said = study(&["--cases", "cases.csv"]).expect("Python");
    assert!(
        said.code == Some(2) && said.err.contains("lines 2 and 3 have the label soft"),
        "{said:?}"
    );
}

/// A study is drawn while it runs and afterwards: its numbers are those of the table, and a failed run is named.
#[test]
fn a_study_is_drawn_over_its_values() {
    let directory = TestDirectory::new();
    let study = ["study", "scene.toml", "--out", "out/s", "--plot", "work,bottom.force_y"];
    let sets =
        ["--set", "material.poisson=0.3,0.7,0.1", "--set", "boundary.top.traction=[0, -1],[0, -3]"];
    // A wrong name is refused before there are runs.
    let wrong = [&study[..4], &["--plot", "botom.force_y"], &sets[..]].concat();
    let Some(said) = directory.say_python(&wrong) else { return };
    said.fails(2, &["botom.force_y is no figure of scene.toml; did you mean bottom.force_y?"]);
    assert!(!directory.path("out/s").exists());
    let said = directory.say(&[&study[..], &sets].concat());
    assert_eq!(said.code, Some(1), "{said:?}");
    assert!(said.err.contains("lack the failed runs poisson=0.7"), "{said:?}");
    for name in ["work", "bottom.force_y"] {
        assert!(directory.path(&format!("out/s/curves_{name}.png")).exists(), "{said:?}");
    }
    let numbers = directory.read("out/s/curves_work.csv");
    let rows: Vec<Vec<&str>> = numbers.lines().map(|row| row.split(',').collect()).collect();
    assert_eq!(rows[0][..2], ["run", "material.poisson"], "{numbers}");
    assert!(rows.len() == 5 && rows[0].contains(&"work (J/m)"), "{numbers}");
    assert!(rows[1..].iter().all(|row| row[1] != "0.7"), "{numbers}");

    let plot = ["plot", "out/s", "--figure", "work", "--format", "svg"];
    let said = directory.say(&[&plot[..], &["--over", "boundary.top.traction"]].concat());
    assert_eq!(said.out, "out/s/curves_work.csv\nout/s/curves_work.svg\n", "{said:?}");
    let picture = directory.read("out/s/curves_work.svg");
    assert!(picture.contains("[0, -3]") && picture.contains("material.poisson = 0.1"), "{said:?}");
    directory.say(&[&plot[..], &["--over", "material.young"]].concat()).fails(
        2,
        &["--over material.young: the runs do not differ in it; choose material.poisson"],
    );
    let one = directory.say(&["plot", "out/s/poisson=0.3__traction=_0___-1_", "--figure", "work"]);
    assert!(one.err.contains("one run makes a single dot; figures of a run in time:"), "{one:?}");
    let wrong = directory.say(&["plot", "out/s", "--figure", "wrok"]);
    wrong.fails(2, &["no summary has wrok; did you mean work"]);
    // The table of the study's folder is that of its runs.
    let table = directory.say(&["table", "out/s", "--columns", "work", "--csv"]);
    assert!(table.out.lines().count() == 5 && table.err.contains("poisson=0.7"), "{table:?}");
}

/// Names and units are text for LaTeX, and numbers with their bars are those of siunitx.
#[test]
fn a_table_for_latex_compiles() {
    let directory = TestDirectory::new();
    directory.run(&["--out", "out/50%_soft"]);
    let mut summary = directory.summary("out/50%_soft");
    summary["figures"]["work"]["value"] = 5.35702.into();
    summary["figures"]["work"]["bar"] = 0.00061.into();
    summary["figures"]["bottom.force_y"]["value"] = 1.40161e-7.into();
    summary["figures"]["bottom.force_y"]["bar"] = 2.7e-11.into();
    summary["figures"]["von_mises_max"]["value"] = 23153.0.into();
    summary["figures"]["von_mises_max"]["singular"] = "a corner".into();
    directory.write("out/50%_soft/summary.json", &summary.to_string());
    let columns = "work,bottom.force_y,von_mises_max";
    let words = ["table", "out/50%_soft", "--latex", "--columns", columns];
    let Some(said) = directory.say_python(&words) else { return };
    for text in [
        r"run & work (\unit{J/m}) & bottom.force\_y (\unit{N/m}) & von\_mises\_max (\unit{Pa})",
        r"50\%\_soft & \num{5.3570 +- 0.0007} & \num{1.40161 +- 0.00027 e-7} & \num{23000} singular",
        r"\toprule",
    ] {
        assert!(said.out.contains(text), "no `{text}` in {}", said.out);
    }
    let page = r"\documentclass{article}\usepackage{booktabs,siunitx}\begin{document}";
    directory.write("page.tex", &format!("{page}\n{}\\end{{document}}\n", said.out));
    let mut pdflatex = Command::new("pdflatex");
    let pdflatex = pdflatex.args(["-interaction=nonstopmode", "-halt-on-error", "page.tex"]);
    let Ok(made) = pdflatex.current_dir(directory.path(".")).output() else { return };
    let log = String::from_utf8_lossy(&made.stdout).into_owned();
    assert!(made.status.success() || log.contains("not found"), "{log}");
}

#[test]
fn figures_stand_with_units_bars_and_singular_flags() {
    // The bar is rounded up, the figure to the bar's digit; a figure without a bar stands as it was, an extreme
    // that the mesh does not determine with two digits.
    let directory = TestDirectory::new();
    directory.run(&[]);
    let mut summary = directory.summary("out/scene");
    summary["figures"]["work"]["value"] = 5.35702.into();
    summary["figures"]["contact_force"]["value"] = 2.5.into();
    summary["figures"]["von_mises_max"]["value"] = 23153.0.into();
    summary["figures"]["bottom.force_y"]["value"] = 1.40161e-7.into();
    summary["figures"]["work"]["bar"] = 0.00041.into();
    summary["figures"]["bottom.force_y"]["bar"] = 2.7e-11.into();
    summary["figures"]["von_mises_max"]["singular"] = "a corner".into();
    summary["figures"]["pressure_max"]["value"] = 291.0.into();
    summary["figures"]["pressure_max"]["unresolved"] = "a kink".into();
    summary["reached"] = serde_json::json!(false);
    directory.write("out/scene/summary.json", &summary.to_string());
    let words =
        ["table", "out/scene", "--columns", "work,von_mises_max,pressure_max,errors.solver"];
    let Some(said) = directory.say_python(&words) else { return };
    assert_eq!(said.code, Some(0), "{said:?}");
    for text in [
        "work (J/m)",
        "5.3570 ± 0.0005",
        "23000 singular",
        "290 not resolved",
        "reached",
        " no ",
        "finished",
    ] {
        assert!(said.out.contains(text), "no `{text}` in {}", said.out);
    }
    let csv = directory.say(&[&words[..], &["--csv"]].concat());
    let head = "run,work (J/m),work.bar (J/m),von_mises_max (Pa),von_mises_max.singular,\
                pressure_max (Pa),pressure_max.unresolved,errors.solver,reached,status";
    assert_eq!(csv.out.lines().next(), Some(head));
    assert!(csv.out.contains("scene,5.35702,0.00041,23153.0,a corner,"), "{}", csv.out);
    let unknown = ["table", "out/scene", "--columns", "errors.solvr"];
    directory.say(&unknown).fails(2, &["no summary has errors.solvr; did you mean errors.solver"]);

    let info = directory.say(&["info", "out/scene"]).out;
    assert_eq!(directory.say(&["report", "out/scene"]).code, Some(0));
    let page = directory.read("out/scene/report.html");
    for text in ["5.3570 ± 0.0005", "(1.40161 ± 0.00027)e-7"] {
        assert!(
            info.contains(text) && page.contains(text),
            "no `{text}` in: {info}, or the report"
        );
    }
    assert!(info.lines().any(|line| line.ends_with(" 2.5 N/m")), "{info}");
}

#[test]
fn a_failing_run_of_a_study_is_told_and_the_others_go_on() {
    let directory = TestDirectory::new();
    let Some(said) =
        directory.say_python(&["study", "scene.toml", "--set", "material.poisson=0.3,0.7"])
    else {
        return;
    };
    assert_eq!(said.code, Some(1), "{said:?}");
    assert!(said.out.contains("material.poisson must be between"), "{}", said.out);
    // The failed run keeps its row, and the varied value its column.
    let table = directory.read("out/scene-study/study.csv");
    let rows: Vec<&str> = table.lines().collect();
    assert!(rows.len() == 3 && rows[0].starts_with("run,material.poisson,end_time (s)"), "{table}");
    assert!(rows[1].contains(",0.3,") && rows[1].contains(",finished,"), "{table}");
    assert!(rows[2].contains(",0.7,") && rows[2].contains(",failed,"), "{table}");
    let twice = ["study", "scene.toml", "--set", "time.end=1", "--set", "time.end=2"];
    directory.say(&twice).fails(2, &["--set time.end is given twice"]);
}

/// A study that cannot start is refused once, before it makes a folder. One whose reader goes ends complete, and a column of a
/// varied key has its values.
#[test]
fn a_study_is_complete_or_refused() {
    let directory = TestDirectory::new();
    let words = ["study", "scene.toml", "--set", "material.young=80,160", "--out", "out/s"];
    for (more, problem) in [
        (&["--jobs", "0"][..], "--jobs must be at least 1"),
        (&["--", "--acuracy", "0.1"], "unexpected argument '--acuracy'"),
        (&["--", "--accuracy", "low"], "write a number with a decimal point"),
    ] {
        let Some(said) = directory.say_python(&[&words[..], more].concat()) else { return };
        said.fails(2, &[problem]);
        assert_eq!(said.err.matches("error: ").count(), 1, "{said:?}");
    }
    let piped = [&["study", "/dev/stdin"], &words[2..]].concat();
    directory.say(&piped).fails(2, &["/dev/stdin: it is a pipe or a device"]);
    assert!(!directory.path("out").exists());

    let program = env!("CARGO_BIN_EXE_signorini");
    let line =
        format!("'{program}' {} --columns material.young,work; echo $? > code", words.join(" "));
    let status = Command::new("sh")
        .args(["-c", &format!("{{ {line}; }} | head -1 > first")])
        .current_dir(directory.path("."))
        .status();
    assert!(status.expect("sh").success());
    assert_eq!(directory.read("code"), "0\n");
    let table = directory.read("out/s/study.csv");
    assert!(table.starts_with("run,material.young,work (J/m)"), "{table}");
    assert!(table.contains(",80,") && table.contains(",160,"), "{table}");
}

/// Uniform pressure 3 on the unit square: u_y = −3 y/E, σ_yy = −3.
#[test]
fn curves_and_the_python_module_give_the_exact_fields() {
    let directory = TestDirectory::new();
    directory.run(&["--set", "discretisation.displacement=2"]);
    let words = ["plot", "out/scene", "--line", "0.5,0,0.5,1.5", "--quantity", "u_y,stress_yy"];
    let Some(said) =
        directory.say_python(&[&words[..], &["--times", "0.5,1", "--format", "svg"]].concat())
    else {
        return;
    };
    assert_eq!(said.code, Some(0), "{said:?}");
    let table = directory.read("out/scene/curves_line_stress_yy.csv");
    let rows: Vec<Vec<&str>> = table.lines().skip(1).map(|row| row.split(',').collect()).collect();
    assert_eq!(rows.len(), 2 * 401);
    for row in rows {
        let [time, s, stress] = [1, 2, 3].map(|i| row[i].trim().parse::<f64>().expect("a number"));
        match s <= 1.0 {
            true => assert!((stress + 3.0 * time).abs() < 1e-5, "{row:?}"),
            false => assert!(stress.is_nan(), "{row:?}"),
        }
    }
    directory
        .say(&["plot", "out/scene", "--along", "none"])
        .fails(2, &["there is no boundary none"]);
    // Γ_C is the bottom.
    let inside = ["plot", "out/scene", "--line", "0.5,0.5,0.5,1", "--quantity", "normal_pressure"];
    directory.say(&inside).fails(2, &["normal_pressure has no values along this line"]);
    let abscissa = ["plot", "out/scene", "--abscissa", "none"];
    directory.say(&abscissa).fails(2, &["history.csv has no column none; it has step, time"]);
    let material = ["plot", "out/scene", "--material", "none"];
    directory.say(&material).fails(2, &["no triangle has the material none"]);
    // A column of a journal, without the margins that are cut off.
    let column = ["plot", "out/scene", "study.csv", "--width", "3.5"];
    directory.write("study.csv", "");
    assert_eq!(directory.say(&column).code, Some(0));
    for picture in ["setting", "stress-damage", "principal-stresses", "pressure"] {
        let file = std::fs::read(directory.path(&format!("out/scene/{picture}.png"))).expect("PNG");
        let width = u32::from_be_bytes(file[16..20].try_into().unwrap());
        assert!((400..=600).contains(&width), "{picture}: {width} pixels of 1/160 inch");
    }

    let scripts = concat!(env!("CARGO_MANIFEST_DIR"), "/scripts");
    let program = format!(
        "import sys; sys.path.insert(0, '{scripts}')\n\
         from signorini_results import load, run\n\
         results = load('out/scene')\n\
         frame = results.frame(1)\n\
         along, gap = frame.along('bottom', 'gap')\n\
         print(along.max(), abs(gap).max() < 1e-9, results.times[-1])\n\
         s, u = frame.line((0.3, 0), (0.3, 1), 'u_y', 3)\n\
         print(abs(u[2] - 2*u[1]) < 1e-6*abs(u[2]), u[2] < -3/80, len(results.history['work']))\n\
         print(frame.at((0.3, 1), 'u_y') == u[2], frame.at((0.3, 1), 'displacement').shape)\n\
         strain = frame.at([(0.3, 0.4), (1, 1), (2, 0)], 'strain_yy')\n\
         print(abs(strain[:2]/u[2] - 1).max() < 1e-5, strain[2], frame.gradient((0.3, 0), 'zeta').shape)\n\
         again = run('scene.toml', out='out/stiff', material={{'young': 160}})\n\
         print(again.figures['displacement_max']['value'] < results.figures['displacement_max']['value'])\n\
         print(results.plot('von_mises', factor=20).get_title())\n\
         frame.to_gmsh('frame.msh')"
    );
    let python = std::env::var("PYTHON").unwrap_or("/usr/bin/python3".to_owned());
    let mut command = Command::new(python);
    let command = command.args(["-c", &program]).current_dir(directory.path("."));
    let ran = command.env("SIGNORINI", env!("CARGO_BIN_EXE_signorini")).output();
    let ran = ran.expect("Python");
    assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
    assert_eq!(
        String::from_utf8_lossy(&ran.stdout),
        "1.0 True 1.0\nTrue True 11\nTrue (3,)\nTrue nan (2,)\nTrue\nt = 1 s, displacements × 20\n"
    );
    let frame = directory.path("frame.msh");
    let read = Command::new("gmsh").arg("-check").arg(frame).output().expect("gmsh").stdout;
    let read = String::from_utf8_lossy(&read).into_owned();
    assert!(read.contains("Done checking") && !read.contains("Error"), "{read}");
}
