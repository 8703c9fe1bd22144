//! Meshes `.geo` files with the gmsh command line.

mod cache;
mod process;

pub use cache::renamed;
use process::{SIDES_OF_BOX, SQUARES};
pub(super) use process::{note, run};

use super::{
    FORMATS, Format, Mesh, MeshError, Order, convert,
    msh::{parse, parse_made, read},
};
use crate::whole_file;
use cache::Inputs;
use std::{
    collections::BTreeMap,
    ffi::OsString,
    io,
    path::{Path, PathBuf},
};

/// The largest number of squares with the mesh size as their side in the box around a body. gmsh would work for hours on more.
const MOST_SQUARES: f64 = 1e8;

/// Reads a `.msh`, meshes a geometry with gmsh or converts the mesh of another program unless this was done before, and sorts
/// nodes and triangles ([`Mesh::in_morton_order`]). `parameters` and `order` apply to a geometry only.
///
/// The mesh is kept beside its file. Its name lists the parameters and order 2, as in `bridge-grading=3-size=0.25.msh`,
/// `hertz.order2.msh` and, for other files than a `.geo`, `part.step-size=2.msh`. It is read again if gmsh would make it
/// from the same files, parameters and order, and is the same program.
///
/// Each parameter overrides the `DefineConstant` of its name. `size`, in m, also bounds the length of the edges.
///
/// # Errors
/// Those of [`read`], and any other extension; a `.geo` cannot be read, a parameter makes no sense or occurs
/// nowhere in the `.geo`, gmsh is missing, or gmsh reports an error.
pub fn load(
    path: &Path,
    parameters: &BTreeMap<String, f64>,
    order: Order,
) -> Result<Mesh, MeshError> {
    load_choosing(path, parameters, None, order)
}

/// As [`load`]; of a mesh of another program with arrays on its cells, the array `materials` has the numbers of the materials.
///
/// # Errors
/// Those of [`load`], and no array has this name.
pub fn load_choosing(
    path: &Path,
    parameters: &BTreeMap<String, f64>,
    materials: Option<&str>,
    order: Order,
) -> Result<Mesh, MeshError> {
    let mesh = match Format::of(path) {
        Some(Format::Msh) => read(path),
        Some(format) => kept(path, format, (parameters, materials), order),
        None => Err(MeshError::file(path, format!("a mesh is {FORMATS}"))),
    };
    mesh.map(Mesh::in_morton_order)
}

/// Meshes a `.geo` file with edges about as long as `sizes`, m, which belong to the nodes of another mesh of this file. The
/// mesh is not kept.
///
/// # Errors
/// Those of [`load`] for a `.geo`.
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
    let bytes = run(geo, arguments(parameters), &last)?;
    parse_made(&bytes, geo).map(Mesh::in_morton_order)
}

/// The mesh of a geometry or of another program, kept beside its file.
fn kept(
    geo: &Path,
    format: Format,
    (parameters, materials): (&BTreeMap<String, f64>, Option<&str>),
    order: Order,
) -> Result<Mesh, MeshError> {
    let text = read_text(geo).map_err(MeshError::io(geo))?;
    let is_script = process::is_script(geo);
    if is_script && text.contains('\0') {
        return Err(MeshError::file(geo, "is in UTF-16 or no text; save the file in UTF-8"));
    }
    // gmsh 4.8 drops the others silently.
    if is_script
        && !text.ends_with('\n')
        && text.lines().last().is_some_and(|last| last.matches(';').count() > 1)
    {
        let problem = "its last line does not end with a newline, so that gmsh reads only the first command \
                       there; add the newline";
        return Err(MeshError::file(geo, problem));
    }
    let name = if is_script { geo.file_stem() } else { geo.file_name() };
    let mut name = name.unwrap_or_default().to_owned();
    for (parameter, &value) in parameters {
        if let Some(reason) = refusal(&text, parameter, value) {
            let problem = format!("mesh parameter `{parameter}` = {value}: {reason}");
            return Err(MeshError::file(geo, problem));
        }
        name.push(format!("-{parameter}={value}"));
    }
    // No parameter makes such a name, as names of parameters have no point.
    let is_quadratic = order == Order::Quadratic && format == Format::Geometry;
    name.push(if is_quadratic { ".order2.msh" } else { ".msh" });
    let path = geo.with_file_name(name);

    let chosen = materials.map(|name| format!("materials={name}").into());
    let arguments = arguments(parameters).into_iter().chain(chosen).collect::<Vec<OsString>>();
    let last = match format {
        Format::Geometry => last_words(&text, parameters, order),
        _ => convert::sources(),
    };
    let inputs = Inputs::read(geo).map_err(MeshError::io(geo))?;
    let digest = inputs.digest(&arguments, &last);
    let cached = whole_file::read(&path);
    let gmsh = cache::program();
    let origin = cached.as_ref().ok().and_then(|file| cache::origin(file));
    if let (Ok(file), Some([made_from, made_by])) = (&cached, origin)
        && made_from == digest
        && inputs.are_all
        && gmsh.as_ref().is_none_or(|gmsh| gmsh == made_by)
    {
        return parse(file, &path);
    }
    let bytes = match format {
        Format::Geometry => run(geo, arguments, &last)?,
        _ => convert::run(geo, materials)?,
    };
    let mesh = parse_made(&bytes, geo)?;
    if whole_file::is_free(&path, || origin.is_some()) {
        let origin = [&*digest, &gmsh.unwrap_or_default()];
        let signed = [&bytes, cache::signature(&bytes, origin).as_bytes()].concat();
        if let Err(error) = whole_file::write(&path, &signed, |_| Ok(())) {
            note(&path, &format!("it cannot be written ({error}), so that every run meshes anew"));
        }
    } else {
        let problem = "it is not as this program wrote it, so that it is neither used nor replaced and every run \
                       meshes anew; rename it, or name it as mesh.file to use it";
        note(&path, problem);
    }
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
    whole_file::read(path).map(|bytes| String::from_utf8_lossy(&bytes).into_owned())
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

/// The files that a mesh is made from, with names for copies in another folder. The first is `file` itself. There are none if
/// they are not known.
pub fn copies(file: &Path) -> Vec<(String, PathBuf)> {
    match Format::of(file) {
        Some(Format::Msh) => vec![("scene.msh".to_owned(), file.to_owned())],
        _ => Inputs::read(file).map_or_else(|_| Vec::new(), Inputs::copies),
    }
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
/// those in the `.geo`.) A size that is far too small is an error, whichever file sets it.
fn last_words(text: &str, parameters: &BTreeMap<String, f64>, order: Order) -> String {
    let checks = parameters.iter().map(|(name, value)| {
        format!(
            "If ({name} != {value})\n Error(\"`{name}` = {value}: the .geo file assigns it, which \
             overrules this value; write DefineConstant[ … ] there\");\nEndIf\n"
        )
    });
    let order = if order == Order::Quadratic { "Mesh.ElementOrder = 2;\n" } else { "" };
    let size = parameters.get("size").filter(|_| !bounds_by_size(text));
    let size = size.map_or(String::new(), |size| format!("Mesh.MeshSizeMax = {size};\n"));
    let too_small = format!(
        "BoundingBox;\nIf ({SQUARES} > {MOST_SQUARES:e})\n \
         Error(\"size = %g is too small for a body of %g by %g (in the unit of the geometry; gmsh reads .step in \
         mm)\", Mesh.MeshSizeMax, {SIDES_OF_BOX});\n Exit;\nEndIf\n"
    );
    checks.chain([order.to_owned(), size, too_small]).collect()
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
