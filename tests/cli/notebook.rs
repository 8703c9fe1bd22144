//! The Python module, as a program and a notebook use it.

use crate::test_directory::TestDirectory;
use std::process::Command;

const ROOT: &str = env!("CARGO_MANIFEST_DIR");

/// The output of Python on some arguments in the directory; `None` if it lacks a package.
fn python(directory: &TestDirectory, arguments: &[&str]) -> Option<String> {
    let python = std::env::var("PYTHON").unwrap_or("/usr/bin/python3".to_owned());
    let mut command = Command::new(python);
    command.args(arguments).current_dir(directory.path("."));
    command.env("SIGNORINI", env!("CARGO_BIN_EXE_signorini"));
    command.env("PYTHONPATH", format!("{ROOT}/scripts"));
    let ran = command.output().expect("Python");
    let [out, err] = [ran.stdout, ran.stderr].map(|text| String::from_utf8(text).expect("UTF-8"));
    if err.contains("No module named") {
        eprintln!("skipped: {err}");
        return None;
    }
    assert!(ran.status.success(), "{out}{err}");
    Some(out)
}

/// A path, an open file and a dict are the same scene; its result has its matrices, its history as a frame, and pictures.
#[test]
fn a_scene_is_a_path_a_file_or_a_dict_and_its_result_shows_itself() {
    let directory = TestDirectory::new();
    let program = "
import tomllib, numpy as np, pandas
from signorini_results import run
path = run('scene.toml', out='out/path')
with open('scene.toml') as file:
    opened = run(file)
scene = tomllib.load(open('scene.toml', 'rb'))
given = run(scene, out='out/dict')
for one in (opened, given):
    assert one.history.drop(columns='seconds').equals(path.history.drop(columns='seconds'))
scene['mesh'] = {'file': __import__('pathlib').Path('square.msh').resolve()}
assert run(scene, out='out/path of a mesh').columns['work'][-1] == path.columns['work'][-1]
assert opened.folder.name == 'scene' and isinstance(path.history, pandas.DataFrame)
assert path.columns['work'][-1] == path.history['work'].iloc[-1] > 0
text = repr(path)
assert 'finished at t = 1 s after 10 steps' in text and 'work of the loads' in text and '±' not in text
assert '<img src=\"data:image/png;base64,' in path._repr_html_()
axes = path.plot('damage', time=0.5, factor=2)
assert axes.get_title() == 't = 0.5 s, displacements × 2' and path.plot('stress_yy', axes=axes) is axes
x, y = path.plot.pressure().lines[0].get_data()
assert np.ptp(x) == 1 and y.max() == path.frame().along('bottom', 'normal_pressure')[1].max() > 0
found, frame = path.matrices(0.5), path.frame(0.5)
assert frame.time == 0.5 == found.about['time'] and found.K.shape == (len(found.u),) * 2
u = frame.at(found.nodes[:, 1:], 'displacement')[:, :2]
assert abs(u.ravel() - found.u).max() < 1e-12 * abs(u).max()
assert abs(found.M.sum() - 1) < 1e-12 and len(found.triangles) == 32
try:
    run(scene, out='out/dict', material={'young': -1})
except RuntimeError as error:
    assert 'material.young' in str(error) and str(error).startswith('the scene'), error
assert path.animate('damage', 'damage.gif', rate=10) == path.animate('stress_yy', 'damage.gif', factor=2)
try:
    path.animate('damage', 'scene.toml')
except ValueError as error:
    assert 'gif or mp4' in str(error)
open('mine.gif', 'w').write('mine')
try:
    path.animate('damage', 'mine.gif')
except OSError as error:
    assert 'move it away' in str(error)
assert open('mine.gif').read() == 'mine'
print('all')
";
    if let Some(said) = python(&directory, &["-c", program]) {
        assert_eq!(said, "all\n");
    }
    assert!(!directory.names(".").iter().any(|name| name.starts_with(".scene")));
}

/// Every cell of the notebook runs and shows something, without warnings.
#[test]
fn the_notebook_of_the_class_runs() {
    let directory = TestDirectory::new();
    let words = [&format!("{ROOT}/tests/cli/class.py")[..], &format!("{ROOT}/geo/class.ipynb")];
    let Some(said) = python(&directory, &words) else { return };
    assert_eq!(said, "9 17 17 []\n");
}
