//! The tables of a scene file that stand alone: from TOML values to a scene that makes sense.
//!
//! Each reader first asks for all keys of its table and only then looks whether a value was refused
//! (`?`): so every value is judged, and no key that it knows passes for unknown.

use std::path::Path;

use super::boundary::boundaries;
use super::document::Content;
use super::expression::Expression;
use super::reader::{Reading, Table, Value};
use super::{Damage, MeshSource, OutputOptions, Scene, Stepping, TimeGrid, may_start_at};
use crate::{
    fem::Mass,
    model::{DamageLaw, Material, Plane},
};

/// More steps than this are a slip of the pen.
const MOST_STEPS: f64 = 1e9;
/// The error of ζ over the damage done that `step = "auto"` allows unless told otherwise.
const STEP_TOLERANCE: f64 = 0.01;

pub(super) fn scene(root: &mut Table, path: &Path) -> Reading<Scene> {
    let title = root.optional("title", Value::text);
    let mesh = root.required("mesh", |value| value.table(".", |table| mesh(table, path)));
    let material = root.required("material", |value| value.table(".", material));
    let damage = root.optional("damage", |value| value.table(".", damage));
    let time = root.optional("time", |value| value.table(".", time));
    let body_force = root.optional("body", |value| value.table(".", body_force));
    let contact = root.optional("contact", Value::options);
    let output = root.optional("output", |value| value.table(".", output));
    let boundaries = root.required("boundary", boundaries);

    let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let (time, note) = time?.unzip();
    Ok(Scene {
        path: path.to_owned(),
        title: title?.unwrap_or_else(|| name.clone()),
        name,
        mesh: mesh?,
        material: material?,
        damage: damage?,
        time,
        body_force: body_force?.flatten().unwrap_or([0.0; 2].map(Expression::constant)),
        contact: contact?.unwrap_or_default(),
        output: output?.unwrap_or_default(),
        boundaries: boundaries?,
        notes: note.flatten().into_iter().collect(),
        text: root.value.scene_text(),
    })
}

fn mesh(table: &mut Table, scene: &Path) -> Reading<MeshSource> {
    let file = table.required("file", |value| {
        let file = value.text()?;
        match Path::new(&file).extension().and_then(|extension| extension.to_str()) {
            Some("geo" | "msh") => Ok(file),
            _ => Err(value.refuse("must be a .geo or .msh file")),
        }
    });
    let size = table.optional("size", |value| value.positive("m"));
    let parameters =
        table.optional("parameters", |value| value.map(|value| value.number("finite", |_| true)));

    let (file, size, parameters) = (file?, size?, parameters?);
    if file.ends_with(".msh") && (size.is_some() || parameters.is_some()) {
        let key = if size.is_some() { "size" } else { "parameters" };
        let problem = format!("has no effect: \"{file}\" is used as it is; name its .geo");
        return Err(table.refuse(key, problem));
    }
    let mut parameters = parameters.unwrap_or_default();
    if let Some(size) = size
        && parameters.insert("size".into(), size).is_some()
    {
        return Err(table.refuse("size", "is given a second time in mesh.parameters; keep one"));
    }
    Ok(MeshSource { file: scene.parent().unwrap_or(Path::new("")).join(file), parameters })
}

fn material(table: &mut Table) -> Reading<Material> {
    let young = table.required("young", |value| value.positive("Pa"));
    let poisson = table.required("poisson", |value| {
        value.number("between -1 and 0.5, both excluded", |nu| -1.0 < nu && nu < 0.5)
    });
    let plane = table.required("plane", |value| {
        value.choice([("stress", Plane::Stress), ("strain", Plane::Strain)])
    });
    Ok(Material { young: young?, poisson: poisson?, plane: plane? })
}

fn damage(table: &mut Table) -> Reading<Damage> {
    let rate = |value: &Value| value.number("at least 0 (1/s)", |rate| rate >= 0.0);
    let diffusion = table.required("diffusion", |value| value.positive("m²/s"));
    let lambda_d = table.required("lambda_d", rate);
    let lambda_u = table.required("lambda_u", rate);
    let lambda_w = table.required("lambda_w", rate);
    let strain_cap = table.required("strain_cap", |value| value.number("positive", |q| q > 0.0));
    let threshold = table.required("threshold", Value::fraction);
    let initial = table.required("initial", Value::expression_in_space);
    let mass = table.optional("mass", |value| {
        value.choice([("consistent", Mass::Consistent), ("lumped", Mass::Lumped)])
    });

    let law = DamageLaw {
        diffusion: diffusion?,
        lambda_d: lambda_d?,
        lambda_u: lambda_u?,
        lambda_w: lambda_w?,
        strain_cap: strain_cap?,
        threshold: threshold?,
    };
    let initial = initial?;
    match initial.as_constant() {
        Some(value) if !may_start_at(&law, value) => {
            let problem = format!("must be in ({}, 1], but is {value}", law.threshold);
            Err(table.refuse("initial", problem))
        }
        _ => Ok(Damage { law, initial, mass: mass?.unwrap_or_default() }),
    }
}

/// The time grid, and what to tell where the step that is written does not divide the end.
fn time(table: &mut Table) -> Reading<(TimeGrid, Option<String>)> {
    let end = table.required("end", |value| value.positive("s"));
    // None: chosen by an estimate of the error.
    let step = table.required("step", |value| match &value.node.content {
        Content::Text(text) if text == "auto" => Ok(None),
        Content::Text(_) => Err(value.refuse("must be a number (s) or \"auto\"")),
        _ => value.positive("s").map(Some),
    });
    let tolerance = table.optional("tolerance", |value| {
        value.number("at least 1e-5 (rounding hides smaller errors of ζ) and below 1", |number| {
            (1e-5..1.0).contains(&number)
        })
    });

    let (end, step, tolerance) = (end?, step?, tolerance?);
    let Some(step) = step else {
        let tolerance = tolerance.unwrap_or(STEP_TOLERANCE);
        return Ok((TimeGrid { end, stepping: Stepping::Auto { tolerance } }, None));
    };
    if tolerance.is_some() {
        return Err(table.refuse("tolerance", "has no effect unless step = \"auto\""));
    }
    if step > end {
        let problem = format!("must be positive and at most the end, {end} s, but is {step}");
        return Err(table.refuse("step", problem));
    }
    if end / step > MOST_STEPS {
        let problem = format!("is {step}: more than {MOST_STEPS:e} steps to {end} s");
        return Err(table.refuse("step", problem));
    }
    let grid = TimeGrid::uniform(end, step);
    Ok((grid, other_step(grid, step)))
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

fn body_force(table: &mut Table) -> Reading<Option<[Expression; 2]>> {
    table.optional("force", |value| value.pair(Value::expression))
}

fn output(table: &mut Table) -> Reading<OutputOptions> {
    Ok(OutputOptions { every: table.optional("every", |value| value.whole(1))? })
}
