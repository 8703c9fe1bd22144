//! Meshes `.geo` files with the gmsh command line.

mod process;

pub(super) use process::run;

use super::{Mesh, MeshError, Order, parse, read};
use crate::whole_file;
use std::{
    collections::BTreeMap,
    ffi::OsString,
    fs, io,
    path::{Path, PathBuf},
    time::SystemTime,
};

/// Reads the mesh from [`file()`] and sorts its nodes and triangles ([`Mesh::in_morton_order`]).
///
/// # Errors
/// Those of [`file()`] and [`read`].
pub fn load(
    path: &Path,
    parameters: &BTreeMap<String, f64>,
    order: Order,
) -> Result<Mesh, MeshError> {
    read(&file(path, parameters, order)?).map(Mesh::in_morton_order)
}

/// Meshes a `.geo` file with edges about as long as `sizes`, m, which belong to the nodes of another mesh of this file. The
/// mesh is not kept.
///
/// # Errors
/// Those of [`mesh_geo`] and [`read`].
pub fn load_graded(
    geo: &Path,
    parameters: &BTreeMap<String, f64>,
    order: Order,
    (mesh, sizes): (&Mesh, &[f64]),
) -> Result<Mesh, MeshError> {
    let text = read_text(geo).map_err(MeshError::io(geo))?;
    let factor = scaling_factor(geo)?;
    let mut last = last_words(&text, parameters, order);
    last.push_str("View \"sizes\" {\n");
    for nodes in &mesh.triangles {
        let corners = nodes.map(|node| mesh.nodes[node].map(|x| x / factor));
        let [[a, b], [c, d], [e, f]] = corners;
        let [p, q, r] = nodes.map(|node| sizes[node] / factor);
        last.push_str(&format!(
            "ST({a:e},{b:e},0,{c:e},{d:e},0,{e:e},{f:e},0){{{p:e},{q:e},{r:e}}};\n"
        ));
    }
    last.push_str(
        "};\nsizes = newf;\nField[sizes] = PostView;\nField[sizes].ViewIndex = PostProcessing.NbViews - 1;\n\
         Background Field = sizes;\n",
    );
    let bytes = run((geo, None), arguments(parameters), &last, "mesh it")?;
    parse(&bytes, geo).map(Mesh::in_morton_order)
}

/// The path of a `.msh`: that of the given file, or of the file that [`mesh_geo`] makes from a `.geo`.
///
/// `parameters` and `order` apply to a `.geo` only.
///
/// # Errors
/// Those of [`mesh_geo`], and any other extension.
pub fn file(
    path: &Path,
    parameters: &BTreeMap<String, f64>,
    order: Order,
) -> Result<PathBuf, MeshError> {
    let extension = path.extension().map(|e| e.to_ascii_lowercase());
    match extension.as_ref().and_then(|e| e.to_str()) {
        Some("msh") => Ok(path.to_owned()),
        Some("geo") => mesh_geo(path, parameters, order),
        _ => Err(MeshError::file(path, "a mesh is a .msh file or a .geo file for gmsh")),
    }
}

/// Meshes a `.geo` file and returns the path of the `.msh` beside it.
///
/// Each parameter overrides the `DefineConstant` of its name. The name of the mesh lists the parameters and
/// order 2, as in `bridge-grading3-size0.25.msh` and `hertz.order2.msh`. `size`, in m, also bounds the length
/// of the edges. A mesh is made again only if it is older than its `.geo` or the files that this includes
/// with `Include` or `Merge`. A new mesh file appears complete or not at all.
///
/// # Errors
/// The `.geo` cannot be read or the `.msh` written, a parameter makes no sense or occurs
/// nowhere in the `.geo`, gmsh is missing, or gmsh reports an error.
pub fn mesh_geo(
    geo: &Path,
    parameters: &BTreeMap<String, f64>,
    order: Order,
) -> Result<PathBuf, MeshError> {
    let started = SystemTime::now();
    let text = read_text(geo).map_err(MeshError::io(geo))?;
    // gmsh 4.8 drops the others silently.
    if !text.ends_with('\n')
        && text.lines().last().is_some_and(|last| last.matches(';').count() > 1)
    {
        let problem = "its last line does not end with a newline, so that gmsh reads only the first command \
                       there; add the newline";
        return Err(MeshError::file(geo, problem));
    }
    let mut name = geo.file_stem().unwrap_or_default().to_owned();
    for (parameter, &value) in parameters {
        if let Some(reason) = refusal(&text, parameter, value) {
            let problem = format!("mesh parameter `{parameter}` = {value}: {reason}");
            return Err(MeshError::file(geo, problem));
        }
        name.push(format!("-{parameter}{value}"));
    }
    // No parameter makes such a name, as names of parameters have no point.
    name.push(if order == Order::Quadratic { ".order2.msh" } else { ".msh" });
    let mesh = geo.with_file_name(name);
    let last_change = last_change(geo).map_err(MeshError::io(geo))?;
    if modified(&mesh).is_ok_and(|meshed| meshed >= last_change) {
        return Ok(mesh);
    }
    let last = last_words(&text, parameters, order);
    let bytes = run((geo, None), arguments(parameters), &last, "mesh it")?;
    // A later change of the .geo is newer.
    whole_file::write(&mesh, &bytes, |file| file.set_modified(started)).map_err(|error| {
        let problem =
            format!("cannot be written: {error}; copy the .geo into a folder where you may write");
        MeshError::file(&mesh, problem)
    })?;
    Ok(mesh)
}

/// The factor by which gmsh multiplies all lengths of a `.geo` file, including `size`, when it writes the
/// mesh: `Mesh.ScalingFactor`, 1 if it is not set.
///
/// # Errors
/// The `.geo` cannot be read, or its factor is not a positive number.
pub fn scaling_factor(geo: &Path) -> Result<f64, MeshError> {
    const OPTION: &str = "Mesh.ScalingFactor";
    let text = read_text(geo).map_err(MeshError::io(geo))?;
    let code: String = text.lines().map(|line| line.split("//").next().unwrap_or("")).collect();
    let Some((_, rest)) = code.rsplit_once(OPTION) else { return Ok(1.0) };
    let number = rest.trim_start().strip_prefix('=').and_then(|rest| rest.split(';').next());
    let factor = number.and_then(|number| number.trim().parse().ok()).filter(|&f: &f64| f > 0.0);
    factor.ok_or_else(|| {
        let problem =
            format!("for an accuracy {OPTION} must be a number, as in `{OPTION} = 0.001;`");
        MeshError::file(geo, problem)
    })
}

fn read_text(path: &Path) -> io::Result<String> {
    fs::read(path).map(|bytes| String::from_utf8_lossy(&bytes).into_owned())
}

/// The reason why gmsh would misread or silently ignore a parameter of the .geo file `text`.
fn refusal(text: &str, name: &str, value: f64) -> Option<&'static str> {
    let word = |c: char| c.is_ascii_alphanumeric() || c == '_';
    // An included file may define the parameter.
    let includes = text.contains("Include") || text.contains("Merge");
    let defined = || includes || text.split(|c| !word(c)).any(|w| w == name);
    if !name.chars().all(word) || !name.starts_with(|c: char| !c.is_ascii_digit()) {
        Some("the name must consist of letters, digits and underscores")
    } else if !value.is_finite() {
        Some("the value must be finite")
    } else if name == "size" {
        (value <= 0.0).then_some("the size must be positive")
    } else {
        (!defined()).then_some("the .geo file has no such parameter")
    }
}

/// Whether no command of a `.geo` reads another file.
pub fn is_self_contained(geo: &Path) -> bool {
    let commands = ["Include", "Merge", "ShapeFromFile"];
    read_text(geo).is_ok_and(|text| !commands.iter().any(|command| text.contains(command)))
}

/// The time of the last change of the `.geo` and of all files that it includes (`Include "name"`, `Merge
/// "name"`), directly or through others. gmsh reports missing files.
fn last_change(geo: &Path) -> io::Result<SystemTime> {
    let mut files = vec![fs::canonicalize(geo)?];
    let mut last = SystemTime::UNIX_EPOCH;
    let mut next = 0;
    while let Some(file) = files.get(next).cloned() {
        next += 1;
        last = last.max(modified(&file)?);
        let text = read_text(&file)?;
        let commands = ["Include", "Merge"].into_iter().flat_map(|word| text.split(word).skip(1));
        let quoted = commands.filter_map(|rest| rest.trim_start().strip_prefix('"'));
        for name in quoted.filter_map(|rest| rest.split('"').next()) {
            // Names are relative to the file that contains them.
            let path = fs::canonicalize(file.with_file_name(name)).ok();
            let new = path.filter(|path| path.is_file() && !files.contains(path));
            files.extend(new);
        }
    }
    Ok(last)
}

fn modified(path: &Path) -> io::Result<SystemTime> {
    fs::metadata(path).and_then(|data| data.modified())
}

/// Whether the `.geo` file `text` sets the largest length of an edge from the parameter `size`.
fn bounds_by_size(text: &str) -> bool {
    let values = ["Mesh.MeshSizeMax", "Mesh.CharacteristicLengthMax"].into_iter();
    let mut values = values.flat_map(|option| text.split(option).skip(1));
    let word = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let of_size = |value: &str| value.split(|c| !word(c)).any(|w| w == "size");
    values.any(|rest| rest.split(';').next().is_some_and(of_size))
}

/// Commands that gmsh reads after the `.geo` file `text`. They make it an error if the `.geo` has changed a
/// parameter, and they set the order and the largest size. (Options of the command line would give way to
/// those in the `.geo`.)
fn last_words(text: &str, parameters: &BTreeMap<String, f64>, order: Order) -> String {
    let kept = parameters.iter().map(|(name, value)| {
        format!(
            "If ({name} != {value})\n Error(\"`{name}` = {value}: the .geo file assigns it, which \
             overrules this value; write DefineConstant[ … ] there\");\nEndIf\n"
        )
    });
    let order = if order == Order::Quadratic { "Mesh.ElementOrder = 2;\n" } else { "" };
    let size = parameters.get("size").filter(|_| !bounds_by_size(text));
    let size = size.map_or(String::new(), |size| format!("Mesh.MeshSizeMax = {size};\n"));
    kept.chain([order.to_owned(), size]).collect()
}

/// gmsh's arguments for a mesh with these parameters.
fn arguments(parameters: &BTreeMap<String, f64>) -> Vec<OsString> {
    // One thread: the same input then gives the same mesh, node by node.
    let mut arguments: Vec<String> = ["-2", "-nt", "1"].map(str::to_owned).into();
    for (name, value) in parameters {
        arguments.extend(["-setnumber".to_owned(), name.clone(), value.to_string()]);
    }
    arguments.into_iter().map(OsString::from).collect()
}
