//! Makes a scene from the tables of a document that the schema allows, and checks that the values fit each
//! other.

use super::boundary::{Boundary, boundary};
use super::expression::Expression;
use super::schema::{Diagnostic, Diagnostics, is_wrong};
use super::{
    Damage, MeshSource, OutputOptions, Probe, Scene, Scheme, Stepping, Surface, TimeGrid, Units,
    may_start_at,
};
use crate::{
    contact::{self, ContactOptions},
    fem::Mass,
    mesh::{FORMATS, Format, Order, has_arrays},
    model::{DamageLaw, Material},
};
use serde::{Deserialize, de::DeserializeOwned};
use std::collections::BTreeMap;
use std::path::Path;

/// The largest number of steps. A larger number is a mistake in the scene.
const MOST_STEPS: f64 = 1e9;

/// The scene of a document. Problems are added to `found`; `None` if a necessary part has a problem.
pub(super) fn scene(found: &mut Diagnostics) -> Option<Scene> {
    let (path, folder) = (&found.text.path, found.text.folder());
    let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let title = found.build("title", Ok);
    let mesh = found.build("mesh", |keys| mesh(keys, folder));
    let material = found.build("material", Ok);
    let damage = found.build("damage", damage);
    let accuracy: Option<f64> = found.build("accuracy", Ok);
    let accuracy_of: Option<Vec<String>> = found.build("accuracy_of", Ok);
    let away: Option<f64> = found.build("away", Ok);
    let [max_memory, max_seconds] = ["max_memory", "max_seconds"].map(|key| found.build(key, Ok));
    let degree: Option<f64> = found.build("discretisation.displacement", Ok);
    let time = found.build("time", time);
    let body_force = found.build("body.force", Ok);
    let gravity: Option<[Expression; 2]> = found.build("body.gravity", uniform);
    let contact = found.build("contact", contact);
    let output = found.build("output", Ok);
    let units = found.build("units", units);
    let boundaries = found.build_all("boundary", boundary);
    let probes = found.build_all("probe", |of| probe(of, &boundaries));
    let materials: Vec<(String, OfSurface)> = found.build("material", surfaces).unwrap_or_default();
    let laws = found.build("damage", surfaces).unwrap_or_default();

    let material: Material = material?;
    check_times(found, output.as_ref(), time, accuracy.is_some());
    let weightless =
        material.density == 0.0 && materials.iter().all(|(_, of)| of.material.density == 0.0);
    let pulls = gravity.iter().flatten().any(|g| g.as_constant() != Some(0.0));
    if weightless && pulls {
        found.note("body.gravity", "has no effect without a density; set material.density");
    }
    let law = damage.as_ref().map(|damage| damage.law);
    let surface = |(name, of): (String, OfSurface)| {
        (name, Surface { material: of.material, law, away: of.away.or(away) })
    };
    let mut surfaces: BTreeMap<String, Surface> = materials.into_iter().map(surface).collect();
    for (name, law) in laws {
        surfaces.entry(name).or_insert(Surface { material, law: None, away }).law = Some(law);
    }
    let degree = degree.unwrap_or(if accuracy.is_some() { 2.0 } else { 1.0 });
    Some(Scene {
        path: path.to_owned(),
        title: title.unwrap_or_else(|| name.clone()),
        name,
        mesh: mesh?,
        material,
        damage,
        surfaces,
        order: if degree == 2.0 { Order::Quadratic } else { Order::Linear },
        accuracy,
        accuracy_of: accuracy_of.unwrap_or_default(),
        away,
        max_memory,
        max_seconds,
        time,
        body_force: body_force?,
        gravity: gravity?,
        contact: contact?,
        output: output?,
        units: units?,
        boundaries,
        probes,
        text: found.text.clone(),
    })
}

/// Notes a time of `output.times` at which no step ends.
fn check_times(
    found: &mut Diagnostics,
    output: Option<&OutputOptions>,
    time: Option<TimeGrid>,
    accurate: bool,
) {
    let missed = |&at: &f64| match time {
        None => Some("a scene without [time] has one state, which is written".to_owned()),
        Some(grid) if at > grid.end => Some(format!("has t = {at}, after time.end")),
        Some(grid) if grid.reaches(at, accurate) => None,
        Some(_) => Some(format!(
            "has t = {at}, at which no step ends; set time.step = \"auto\", or times of steps"
        )),
    };
    if let Some(text) = output.and_then(|output| output.times.iter().find_map(missed)) {
        found.note("output.times", text);
    }
}

/// The table `[material.NAME]`.
#[derive(Deserialize)]
struct OfSurface {
    #[serde(flatten)]
    material: Material,
    away: Option<f64>,
}

/// The tables of the surfaces in a table, by name. The surrounding table completes each of them.
fn surfaces<T: DeserializeOwned>(table: toml::Table) -> Result<Vec<(String, T)>, Diagnostic> {
    let (named, own): (Vec<_>, Vec<_>) = table.into_iter().partition(|(_, value)| value.is_table());
    let with_own = |(name, value): (String, toml::Value)| {
        if name == "material" {
            let problem = "has the name of the rest of the body in the results; give the surface another name";
            return Err(("material", problem.to_owned()));
        }
        let mut all: toml::Table = own.iter().cloned().collect();
        all.extend(value.as_table().cloned().unwrap_or_default());
        Ok((name, all.try_into().map_err(is_wrong)?))
    };
    named.into_iter().map(with_own).collect()
}

/// Gravity, which is the same everywhere.
fn uniform(gravity: [Expression; 2]) -> Result<[Expression; 2], Diagnostic> {
    match gravity.iter().any(Expression::depends_on_space) {
        true => Err(("", "depends on x or y; write such a force as body.force".to_owned())),
        false => Ok(gravity),
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MeshKeys {
    file: String,
    size: Option<f64>,
    parameters: Option<BTreeMap<String, f64>>,
    materials: Option<String>,
}

fn mesh(
    MeshKeys { file, size, parameters, materials }: MeshKeys,
    folder: &Path,
) -> Result<MeshSource, Diagnostic> {
    let Some(format) = Format::of(Path::new(&file)) else {
        return Err(("file", format!("must be {FORMATS}")));
    };
    if format != Format::Geometry && (size.is_some() || parameters.is_some()) {
        let useless = if size.is_some() { "size" } else { "parameters" };
        return Err((
            useless,
            format!("has no effect: \"{file}\" is used as it is; name its geometry"),
        ));
    }
    if materials.is_some() && !has_arrays(Path::new(&file)) {
        let problem = format!("has no effect: \"{file}\" is no .vtu, .vtk or .xdmf with arrays");
        return Err(("materials", problem));
    }
    let mut parameters = parameters.unwrap_or_default();
    if let Some(size) = size
        && parameters.insert("size".into(), size).is_some()
    {
        return Err(("size", "is given a second time in mesh.parameters; keep one".to_owned()));
    }
    Ok(MeshSource { file: folder.join(file), parameters, materials })
}

fn contact(options: ContactOptions) -> Result<ContactOptions, Diagnostic> {
    let unknown = options.solver.as_ref().and_then(|name| contact::find(name).err());
    unknown.map_or(Ok(options), |error| Err(("solver", format!("is unknown: {error}"))))
}

/// The keys of `[damage]`, which also contains the tables of the surfaces.
#[derive(Deserialize)]
struct DamageKeys {
    #[serde(flatten)]
    law: DamageLaw,
    initial: Expression,
    mass: Mass,
}

fn damage(DamageKeys { law, initial, mass }: DamageKeys) -> Result<Damage, Diagnostic> {
    match initial.as_constant() {
        Some(value) if !may_start_at(&law, value) => {
            Err(("initial", format!("must be in ({}, 1], but is {value}", law.threshold)))
        }
        _ => Ok(Damage { law, initial, mass }),
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct TimeKeys {
    end: f64,
    /// A number (s) or "auto" for adaptive steps.
    step: toml::Value,
    tolerance: Option<f64>,
    scheme: Scheme,
}

/// The default tolerance of `step = "auto"`: the error of ζ over the damage.
const STEP_TOLERANCE: f64 = 0.01;

fn time(keys: TimeKeys) -> Result<TimeGrid, Diagnostic> {
    let TimeKeys { end, step, tolerance, scheme } = keys;
    let Ok(length) = step.try_into::<f64>() else {
        let stepping =
            Stepping::Auto { tolerance: tolerance.unwrap_or(STEP_TOLERANCE), expected: [0.0; 2] };
        return Ok(TimeGrid { end, step: None, stepping, scheme });
    };
    if tolerance.is_some() {
        return Err(("tolerance", "has no effect unless step = \"auto\"".to_owned()));
    }
    if length > end {
        let problem = format!("must be positive and at most the end, {end}, but is {length}");
        return Err(("step", problem));
    }
    if end / length > MOST_STEPS {
        return Err(("step", format!("is {length}: more than {MOST_STEPS:e} steps to {end}")));
    }
    Ok(TimeGrid::uniform(end, length, scheme))
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct UnitKeys {
    length: Option<String>,
    force: Option<String>,
    time: String,
    stress: Option<String>,
}

fn units(UnitKeys { length, force, time, stress }: UnitKeys) -> Result<Units, Diagnostic> {
    let si = Units::default();
    let is_si = length.is_none() && force.is_none();
    let (length, force) = (length.unwrap_or(si.length), force.unwrap_or(si.force));
    let derived = if is_si { si.stress } else { format!("{force}/{length}²") };
    Ok(Units { stress: stress.unwrap_or(derived), length, force, time })
}

fn probe(probe: Probe, boundaries: &[Boundary]) -> Result<Probe, Diagnostic> {
    if boundaries.iter().any(|other| other.name == probe.name) {
        return Err(("", "has the name of a boundary; choose another one".to_owned()));
    }
    Ok(probe)
}
