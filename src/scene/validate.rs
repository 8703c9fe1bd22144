//! From the file as written to a scene that makes sense.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::Path;

use toml::Spanned;

use super::error::SceneError;
use super::expression::Expression;
use super::file::{DamageTable, File, Formula, MaterialTable, MeshTable, TimeTable, Vector};
use super::source::Source;
use super::{Damage, MeshSource, OutputOptions, Scene, Stepping, TimeGrid, may_start_at};
use crate::model::{DamageLaw, Material};

/// More steps than this are a slip of the pen.
const MOST_STEPS: f64 = 1e9;
/// The error of ζ over the damage done that `step = "auto"` allows unless told otherwise.
const STEP_TOLERANCE: f64 = 0.01;

pub(super) fn scene(file: File, path: &Path, source: Source) -> Result<Scene, SceneError> {
    let check = Check { source: &source };
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    let body_force = match &file.body.force {
        Some(force) => check.vector(force)?,
        None => [Expression::constant(0.0), Expression::constant(0.0)],
    };
    if let Some(every) = file.output.every.as_ref().filter(|e| *e.get_ref() == 0) {
        return Err(check.invalid(&every.span(), "must be at least 1, but is 0"));
    }
    let time = file.time.as_ref().map(|t| check.time(t)).transpose()?;
    let notes = file.time.iter().zip(time).filter_map(|(t, grid)| other_step(t, grid)).collect();
    Ok(Scene {
        path: path.to_owned(),
        title: file.title.unwrap_or_else(|| name.clone().into_owned()),
        name: name.into_owned(),
        mesh: check.mesh(file.mesh, path)?,
        material: check.material(&file.material)?,
        damage: file.damage.map(|d| check.damage(&d)).transpose()?,
        time,
        body_force,
        contact: file.contact,
        output: OutputOptions { every: file.output.every.map(Spanned::into_inner) },
        boundaries: check.boundaries(&file.boundary)?,
        notes,
        source,
    })
}

/// What to tell where the step that is written does not divide the end.
fn other_step(table: &TimeTable, grid: TimeGrid) -> Option<String> {
    let (Formula::Number(asked), Stepping::Uniform { steps }) =
        (table.step.get_ref(), grid.stepping)
    else {
        return None;
    };
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

pub(super) struct Check<'a> {
    pub(super) source: &'a Source,
}

impl Check<'_> {
    pub(super) fn invalid(&self, span: &Range<usize>, problem: impl Into<String>) -> SceneError {
        SceneError::Invalid {
            place: self.source.place(span),
            key: self.source.key(span).trim_end_matches(": ").to_owned(),
            problem: problem.into(),
        }
    }

    /// A finite number for which `holds`; `rule` says so in words.
    fn number(
        &self,
        number: &Spanned<f64>,
        rule: &str,
        holds: impl Fn(f64) -> bool,
    ) -> Result<f64, SceneError> {
        let value = *number.get_ref();
        if value.is_finite() && holds(value) {
            Ok(value)
        } else {
            Err(self.invalid(&number.span(), format!("must be {rule}, but is {value}")))
        }
    }

    fn positive(&self, number: &Spanned<f64>, unit: &str) -> Result<f64, SceneError> {
        self.number(number, &format!("positive ({unit})"), |v| v > 0.0)
    }

    /// An expression that is finite if it is constant.
    pub(super) fn expression(&self, formula: &Spanned<Formula>) -> Result<Expression, SceneError> {
        let expression = match formula.get_ref() {
            Formula::Number(value) => Expression::constant(*value),
            Formula::Text(text) => {
                Expression::parse(text).map_err(|e| self.invalid(&formula.span(), e.to_string()))?
            }
        };
        match expression.as_constant() {
            Some(value) if !value.is_finite() => {
                Err(self.invalid(&formula.span(), format!("must be finite, but is {value}")))
            }
            _ => Ok(expression),
        }
    }

    /// An expression in x and y.
    pub(super) fn in_space(&self, formula: &Spanned<Formula>) -> Result<Expression, SceneError> {
        let expression = self.expression(formula)?;
        if expression.depends_on_time() {
            let problem = "depends on t; it must be a function of x and y alone";
            return Err(self.invalid(&formula.span(), problem));
        }
        Ok(expression)
    }

    pub(super) fn pair<'v>(
        &self,
        vector: &'v Vector,
    ) -> Result<[&'v Spanned<Formula>; 2], SceneError> {
        match vector.get_ref().as_slice() {
            [x, y] => Ok([x, y]),
            other => {
                let problem = format!("must have two components, but has {}", other.len());
                Err(self.invalid(&vector.span(), problem))
            }
        }
    }

    pub(super) fn vector(&self, vector: &Vector) -> Result<[Expression; 2], SceneError> {
        let [x, y] = self.pair(vector)?;
        Ok([self.expression(x)?, self.expression(y)?])
    }

    fn mesh(&self, table: MeshTable, scene: &Path) -> Result<MeshSource, SceneError> {
        let written = table.file.get_ref();
        let extension = Path::new(written).extension().and_then(|e| e.to_str());
        if !matches!(extension, Some("geo" | "msh")) {
            let problem = format!("must be a .geo or .msh file, but is \"{written}\"");
            return Err(self.invalid(&table.file.span(), problem));
        }
        let mut parameters = BTreeMap::new();
        for (name, value) in &table.parameters {
            parameters.insert(name.clone(), self.number(value, "finite", |_| true)?);
        }
        if let Some(size) = &table.size {
            let value = self.positive(size, "m")?;
            if parameters.insert("size".into(), value).is_some() {
                let problem = "is given a second time in mesh.parameters; keep one";
                return Err(self.invalid(&size.span(), problem));
            }
        }
        if extension == Some("msh")
            && let Some(given) = table.size.iter().chain(table.parameters.values()).next()
        {
            let problem = format!("has no effect: \"{written}\" is used as it is; name its .geo");
            return Err(self.invalid(&given.span(), problem));
        }
        Ok(MeshSource { file: scene.parent().unwrap_or(Path::new("")).join(written), parameters })
    }

    fn material(&self, table: &MaterialTable) -> Result<Material, SceneError> {
        Ok(Material {
            young: self.positive(&table.young, "Pa")?,
            poisson: self.number(&table.poisson, "between -1 and 0.5, both excluded", |v| {
                -1.0 < v && v < 0.5
            })?,
            plane: table.plane,
        })
    }

    fn damage(&self, table: &DamageTable) -> Result<Damage, SceneError> {
        let rate = |n| self.number(n, "at least 0 (1/s)", |v| v >= 0.0);
        let law = DamageLaw {
            diffusion: self.positive(&table.diffusion, "m²/s")?,
            lambda_d: rate(&table.lambda_d)?,
            lambda_u: rate(&table.lambda_u)?,
            lambda_w: rate(&table.lambda_w)?,
            strain_cap: self.number(&table.strain_cap, "positive", |v| v > 0.0)?,
            threshold: self.number(&table.threshold, "between 0 and 1, both excluded", |v| {
                0.0 < v && v < 1.0
            })?,
        };
        let initial = self.in_space(&table.initial)?;
        match initial.as_constant() {
            Some(value) if !may_start_at(&law, value) => {
                let problem = format!("must be in ({}, 1], but is {value}", law.threshold);
                Err(self.invalid(&table.initial.span(), problem))
            }
            _ => Ok(Damage { law, initial, mass: table.mass }),
        }
    }

    fn time(&self, table: &TimeTable) -> Result<TimeGrid, SceneError> {
        let end = self.positive(&table.end, "s")?;
        let step = match table.step.get_ref() {
            Formula::Text(text) if text == "auto" => {
                let in_range = "between 0 and 1, both excluded";
                let given = |n| self.number(n, in_range, |v| 0.0 < v && v < 1.0);
                let tolerance = table.tolerance.as_ref().map_or(Ok(STEP_TOLERANCE), given)?;
                return Ok(TimeGrid { end, stepping: Stepping::Auto { tolerance } });
            }
            Formula::Text(text) => {
                let problem = format!("must be a number (s) or \"auto\", but is \"{text}\"");
                return Err(self.invalid(&table.step.span(), problem));
            }
            Formula::Number(step) => Spanned::new(table.step.span(), *step),
        };
        if let Some(tolerance) = &table.tolerance {
            return Err(self.invalid(&tolerance.span(), "has no effect unless step = \"auto\""));
        }
        let rule = format!("positive and at most the end, {end} s");
        let step = self.number(&step, &rule, |v| 0.0 < v && v <= end)?;
        if end / step > MOST_STEPS {
            let problem = format!("is {step}: more than {MOST_STEPS:e} steps to {end} s");
            return Err(self.invalid(&table.step.span(), problem));
        }
        Ok(TimeGrid::uniform(end, step))
    }
}
