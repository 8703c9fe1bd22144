//! The tables of a scene file that stand alone: from TOML values to a scene that makes sense.
//!
//! Each reader first asks for all keys of its table and only then looks whether a value was refused
//! (`?`): so every value is judged, and no key that it knows passes for unknown.

use std::array;
use std::collections::BTreeMap;
use std::path::Path;

use super::boundary::boundaries;
use super::document::SceneText;
use super::expression::Expression;
use super::reader::{Reading, Table, Value};
use super::{
    Damage, MeshSource, OutputOptions, Probe, Scene, Scheme, Stepping, Surface, TimeGrid, Units,
    may_start_at,
};
use crate::{
    fem::Mass,
    mesh::Order,
    model::{DamageLaw, Material, Plane},
};

/// More steps than this are a slip of the pen.
const MOST_STEPS: f64 = 1e9;
/// The error of ζ over the damage done that `step = "auto"` allows unless told otherwise.
const STEP_TOLERANCE: f64 = 0.01;
/// q* and ζ_* unless told otherwise: those of the paper's examples.
const STRAIN_CAP: f64 = 1000.0;
const THRESHOLD: f64 = 0.01;

pub(super) fn scene(root: &mut Table, path: &Path, text: &SceneText) -> Reading<Scene> {
    let title = root.get("title").optional(Value::read);
    let mesh = root.get("mesh").table(".", |table| mesh(table, path));
    let material = root.get("material").table(".", material);
    let damage = root.get("damage").optional(|value| value.table(".", damage));
    let accuracy = root.get("accuracy").optional(|value| {
        value.number("between 1e-5 and 0.5", |error| (1e-5..=0.5).contains(&error))
    });
    let order = root.get("discretisation").optional(|value| value.table(".", discretisation));
    let time = root.get("time").optional(|value| value.table(".", time));
    let body_force = root.get("body").optional(|value| {
        value.table(".", |body| body.get("force").optional(|value| value.pair(Value::expression)))
    });
    let contact = root.get("contact").optional(Value::options);
    let output = root.get("output").optional(|value| value.table(".", output));
    let units = root.get("units").optional(|value| value.table(".", units));
    let boundaries = boundaries(&root.get("boundary"));
    let list = root.get("probe");
    let probes = list.optional(|list| list.named_tables("probe", probe));

    let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let (time, note) = time?.unzip();
    let (material, materials) = material?;
    let (damage, laws) = damage?.unzip();
    let law = damage.as_ref().map(|damage: &Damage| damage.law);
    let mut surfaces = BTreeMap::new();
    for (name, material) in materials {
        surfaces.insert(name, Surface { material, law });
    }
    for (name, law) in laws.into_iter().flatten() {
        surfaces.entry(name).or_insert(Surface { material, law: None }).law = Some(law);
    }
    let (boundaries, probes) = (boundaries?, probes?.unwrap_or_default());
    if let Some(probe) = probes.iter().find(|p| boundaries.iter().any(|b| b.name == p.name)) {
        let problem = format!("\"{}\" has the name of a boundary; choose another one", probe.name);
        return Err(list.refuse(problem));
    }
    Ok(Scene {
        path: path.to_owned(),
        title: title?.unwrap_or_else(|| name.clone()),
        name,
        mesh: mesh?,
        material,
        damage,
        surfaces,
        order: order?.unwrap_or(if accuracy?.is_some() { Order::Quadratic } else { Order::Linear }),
        accuracy: accuracy?,
        time,
        body_force: body_force?.flatten().unwrap_or([0.0; 2].map(Expression::constant)),
        contact: contact?.unwrap_or_default(),
        output: output?.unwrap_or_default(),
        units: units?.unwrap_or_default(),
        boundaries,
        probes,
        notes: note.flatten().into_iter().collect(),
        text: text.clone(),
    })
}

fn mesh(table: &mut Table, scene: &Path) -> Reading<MeshSource> {
    let (file, size, parameters) = (table.get("file"), table.get("size"), table.get("parameters"));
    let name = file.read::<String>().and_then(|name| match Path::new(&name).extension() {
        Some(extension) if extension == "geo" || extension == "msh" => Ok(name),
        _ => Err(file.refuse("must be a .geo or .msh file")),
    });
    let mesh_size = size.optional(|size| size.positive("m"));
    let constants =
        parameters.optional(|table| table.map(|value| value.number("finite", |_| true)));

    let (name, mesh_size, constants) = (name?, mesh_size?, constants?);
    if name.ends_with(".msh") && (mesh_size.is_some() || constants.is_some()) {
        let useless = if mesh_size.is_some() { size } else { parameters };
        let problem = format!("has no effect: \"{name}\" is used as it is; name its .geo");
        return Err(useless.refuse(problem));
    }
    let mut parameters = constants.unwrap_or_default();
    if let Some(mesh_size) = mesh_size
        && parameters.insert("size".into(), mesh_size).is_some()
    {
        return Err(size.refuse("is given a second time in mesh.parameters; keep one"));
    }
    Ok(MeshSource { file: scene.parent().unwrap_or(Path::new("")).join(name), parameters })
}

/// The material, and those of the physical surfaces that have a table of their own.
fn material(table: &mut Table) -> Reading<(Material, Vec<(String, Material)>)> {
    let young = |value: &Value| value.positive("Pa");
    let poisson = |value: &Value| {
        value.number("between -1 and 0.5, both excluded", |nu| -1.0 < nu && nu < 0.5)
    };
    let [e, nu] = [young(&table.get("young")), poisson(&table.get("poisson"))];
    let plane = table.get("plane").choice([("stress", Plane::Stress), ("strain", Plane::Strain)]);
    let surfaces = table.tables(|table| {
        let e = table.get("young").optional(young);
        let nu = table.get("poisson").optional(poisson);
        Ok((e?, nu?))
    });
    let own = Material { young: e?, poisson: nu?, plane: plane? };
    let other = |(name, (e, nu)): (String, (Option<f64>, Option<f64>))| {
        let (young, poisson) = (e.unwrap_or(own.young), nu.unwrap_or(own.poisson));
        (name, Material { young, poisson, plane: own.plane })
    };
    Ok((own, surfaces?.into_iter().map(other).collect()))
}

fn discretisation(table: &mut Table) -> Reading<Order> {
    let degree = table
        .get("displacement")
        .optional(|value| value.number("1 or 2", |degree| degree == 1.0 || degree == 2.0));
    Ok(if degree? == Some(2.0) { Order::Quadratic } else { Order::Linear })
}

/// The rule of a number.
type Rule = (&'static str, fn(f64) -> bool);

/// The constants that may differ between physical surfaces: κ, λ_D, λ_U, λ_W and q*.
const OF_MATERIAL: [(&str, Rule); 5] = [
    ("diffusion", ("positive (m²/s)", |kappa| kappa > 0.0)),
    ("lambda_d", ("at least 0 (1/s)", |rate| rate >= 0.0)),
    ("lambda_u", ("at least 0 (1/s)", |rate| rate >= 0.0)),
    ("lambda_w", ("at least 0 (1/s)", |rate| rate >= 0.0)),
    ("strain_cap", ("positive", |q| q > 0.0)),
];

/// The damage, and the laws of the physical surfaces that have a table of their own.
fn damage(table: &mut Table) -> Reading<(Damage, Vec<(String, DamageLaw)>)> {
    let number = |value: &Value, (rule, holds): Rule| value.number(rule, holds);
    let own = OF_MATERIAL.map(|(key, rule)| {
        let value = table.get(key);
        match key {
            "lambda_w" => Ok(value.optional(|value| number(value, rule))?.unwrap_or(0.0)),
            "strain_cap" => Ok(value.optional(|value| number(value, rule))?.unwrap_or(STRAIN_CAP)),
            _ => number(&value, rule),
        }
    });
    let threshold = table.get("threshold").optional(|value| {
        value.number("between 0 and 1, both excluded", |zeta| 0.0 < zeta && zeta < 1.0)
    });
    let initial = table.get("initial");
    let zeta_0 = initial.optional(Value::expression_in_space);
    let mass = table.get("mass").optional(|value| {
        value.choice([("consistent", Mass::Consistent), ("lumped", Mass::Lumped)])
    });

    let surfaces = table.tables(|table| {
        let given =
            OF_MATERIAL.map(|(key, rule)| table.get(key).optional(|value| number(value, rule)));
        let [diffusion, lambda_d, lambda_u, lambda_w, strain_cap] = given;
        Ok([diffusion?, lambda_d?, lambda_u?, lambda_w?, strain_cap?])
    });

    let threshold = threshold?.unwrap_or(THRESHOLD);
    let of = |[diffusion, lambda_d, lambda_u, lambda_w, strain_cap]: [f64; 5]| DamageLaw {
        diffusion,
        lambda_d,
        lambda_u,
        lambda_w,
        strain_cap,
        threshold,
    };
    let [diffusion, lambda_d, lambda_u, lambda_w, strain_cap] = own;
    let own = [diffusion?, lambda_d?, lambda_u?, lambda_w?, strain_cap?];
    let law = of(own);
    let other = |(name, given): (String, [Option<f64>; 5])| {
        (name, of(array::from_fn(|i| given[i].unwrap_or(own[i]))))
    };
    let surfaces: Vec<_> = surfaces?.into_iter().map(other).collect();
    let zeta_0 = zeta_0?.unwrap_or(Expression::constant(1.0));
    match zeta_0.as_constant() {
        Some(value) if !may_start_at(&law, value) => {
            Err(initial.refuse(format!("must be in ({}, 1], but is {value}", law.threshold)))
        }
        _ => Ok((Damage { law, initial: zeta_0, mass: mass?.unwrap_or_default() }, surfaces)),
    }
}

/// The time grid, and what to tell where the step that is written does not divide the end.
fn time(table: &mut Table) -> Reading<(TimeGrid, Option<String>)> {
    let end = table.get("end").positive("s");
    let (step, tolerance) = (table.get("step"), table.get("tolerance"));
    // None: chosen by an estimate of the error.
    let length = step.required().and_then(|value| match value.as_str() {
        Some("auto") => Ok(None),
        Some(_) => Err(step.refuse("must be a number (s) or \"auto\"")),
        None => step.positive("s").map(Some),
    });
    let allowed = tolerance.optional(|value| {
        value.number("at least 1e-5 (rounding hides smaller errors of ζ) and below 1", |number| {
            (1e-5..1.0).contains(&number)
        })
    });

    let written = table.get("scheme");
    let scheme =
        written.optional(|value| value.choice([("euler", Scheme::Euler), ("bdf2", Scheme::Bdf2)]));

    let (end, length, allowed, scheme) = (end?, length?, allowed?, scheme?);
    let Some(length) = length else {
        if scheme == Some(Scheme::Euler) {
            return Err(written.refuse("must be \"bdf2\" where step = \"auto\""));
        }
        let stepping = Stepping::Auto { tolerance: allowed.unwrap_or(STEP_TOLERANCE) };
        return Ok((TimeGrid { end, stepping, scheme: Scheme::Bdf2 }, None));
    };
    if allowed.is_some() {
        return Err(tolerance.refuse("has no effect unless step = \"auto\""));
    }
    if length > end {
        let problem = format!("must be positive and at most the end, {end} s, but is {length}");
        return Err(step.refuse(problem));
    }
    if end / length > MOST_STEPS {
        let problem = format!("is {length}: more than {MOST_STEPS:e} steps to {end} s");
        return Err(step.refuse(problem));
    }
    let scheme = scheme.unwrap_or_default();
    let grid = TimeGrid { scheme, ..TimeGrid::uniform(end, length) };
    Ok((grid, other_step(grid, length)))
}

fn other_step(grid: TimeGrid, asked: f64) -> Option<String> {
    let Stepping::Uniform { steps } = grid.stepping else { return None };
    let (end, step) = (grid.end, grid.end / steps as f64);
    (asked - step > 1e-6 * step).then(|| {
        // Six digits: no 0.30000000000000004.
        let step: f64 = format!("{step:.5e}").parse().unwrap_or(step);
        format!(
            "time.step = {asked} s does not divide time.end = {end} s: {steps} steps of {step} s \
             are made"
        )
    })
}

fn output(table: &mut Table) -> Reading<OutputOptions> {
    let every = table.get("every").optional(|value| {
        value.number("a whole number, at least 1", |every| every.fract() == 0.0 && every >= 1.0)
    });
    let checkpoint = table.get("checkpoint");
    let checkpoint =
        checkpoint.optional(|value| value.number("at least 0 (s)", |seconds| seconds >= 0.0));
    let every = every?.map(|every| every as usize);
    let usual = OutputOptions::default();
    Ok(OutputOptions { every, checkpoint: checkpoint?.unwrap_or(usual.checkpoint) })
}

fn units(table: &mut Table) -> Reading<Units> {
    let mut label = |key| table.get(key).optional(Value::read::<String>);
    let (length, force) = (label("length"), label("force"));
    let (time, stress) = (label("time"), label("stress"));
    let (length, force, stress) = (length?, force?, stress?);
    let si = Units::default();
    let is_si = length.is_none() && force.is_none();
    let (length, force) = (length.unwrap_or(si.length), force.unwrap_or(si.force));
    let derived = if is_si { si.stress } else { format!("{force}/{length}²") };
    let stress = stress.unwrap_or(derived);
    Ok(Units { length, force, time: time?.unwrap_or(si.time), stress })
}

fn probe(table: &mut Table) -> Reading<Probe> {
    let (key, point) = (table.get("name"), table.get("point"));
    let name = key.read::<String>();
    let point = point.pair(|value| value.number("finite (m)", |_| true));
    match name? {
        name if name.trim().is_empty() => Err(key.refuse("is empty; its columns begin with it")),
        name => Ok(Probe { name, point: point? }),
    }
}
