//! The conditions on the parts of the boundary. Some of them exclude each other on the same edge.

use super::expression::Expression;
use super::schema::{Diagnostic, is_wrong, keys_of_element};
use serde::Deserialize;
use std::array;

/// A part of the boundary and the conditions on it.
#[derive(Debug, Clone)]
pub struct Boundary {
    /// The physical curve.
    pub name: String,
    /// Selects its edges, where the mesh has no such curve ([`Scene::name_edges`](super::Scene::name_edges)).
    pub selection: Option<Expression>,
    /// At least one condition. The conditions do not contradict each other.
    pub conditions: Vec<Condition>,
}

/// A boundary condition.
#[derive(Debug, Clone)]
pub enum Condition {
    /// Γ_D: the prescribed displacement by component, m. `None` leaves a component free (never both).
    Displacement([Option<Expression>; 2]),
    /// A symmetry axis: u·ν = 0.
    Symmetry,
    /// Γ_C: u·ν ≤ g.
    Gap(Gap),
    /// Γ_N: a surface load.
    Load(SurfaceLoad),
}

impl Condition {
    /// Its key in a scene.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Displacement(_) => "displacement",
            Self::Symmetry => "symmetry",
            Self::Gap(_) => "gap",
            Self::Load(SurfaceLoad::Traction(_)) => "traction",
            Self::Load(SurfaceLoad::Pressure(_)) => "pressure",
        }
    }

    /// Does it support the body, with a force that is an unknown? It then has its values at nodes, and a load at the
    /// points that integrate it.
    pub fn is_support(&self) -> bool {
        !matches!(self, Self::Load(_))
    }

    /// The expressions of its components; `None` for a free component.
    pub fn expressions(&self) -> Vec<Option<&Expression>> {
        match self {
            Self::Displacement(u) => u.iter().map(Option::as_ref).collect(),
            Self::Symmetry => Vec::new(),
            Self::Gap(gap) => vec![Some(&gap.distance)],
            Self::Load(load) => load.expressions().iter().map(Some).collect(),
        }
    }
}

/// A surface load f_N, N/m².
#[derive(Debug, Clone)]
pub enum SurfaceLoad {
    /// f_N by component.
    Traction([Expression; 2]),
    /// p in f_N = −p n, with n the body's outward normal: positive p presses on the body.
    Pressure(Expression),
}

impl SurfaceLoad {
    /// f_N at a point, m, with the outward normal there, and a time, s.
    pub fn at(&self, [x, y]: [f64; 2], normal: [f64; 2], t: f64) -> [f64; 2] {
        match self {
            Self::Traction(f) => f.each_ref().map(|f| f.eval(x, y, t)),
            Self::Pressure(p) => {
                let p = p.eval(x, y, t);
                normal.map(|n| -p * n)
            }
        }
    }

    /// The expressions of the load.
    pub fn expressions(&self) -> &[Expression] {
        match self {
            Self::Traction(f) => f,
            Self::Pressure(p) => array::from_ref(p),
        }
    }
}

/// A rigid obstacle.
#[derive(Debug, Clone)]
pub struct Gap {
    /// g(x, y, t) along the normal, m; negative where the undeformed body overlaps the obstacle.
    pub distance: Expression,
    /// Unit vector towards the obstacle; `None` for the body's outward normal.
    pub normal: Option<[f64; 2]>,
}

impl Boundary {
    /// Does it support the body?
    pub fn is_support(&self) -> bool {
        self.conditions.iter().any(Condition::is_support)
    }

    /// The obstacle, on Γ_C.
    pub fn gap(&self) -> Option<&Gap> {
        self.conditions.iter().find_map(|condition| match condition {
            Condition::Gap(gap) => Some(gap),
            _ => None,
        })
    }

    /// The surface loads, on Γ_N: at most a traction and a pressure.
    pub fn loads(&self) -> impl Iterator<Item = &SurfaceLoad> {
        self.conditions.iter().filter_map(|condition| match condition {
            Condition::Load(load) => Some(load),
            _ => None,
        })
    }
}

/// The names of two conditions in `a` and `b` that contradict each other on a common edge.
pub(super) fn contradiction(a: &[Condition], b: &[Condition]) -> Option<[String; 2]> {
    use Condition::{Displacement, Gap, Load, Symmetry};
    let one_way = |a: &Condition, b: &Condition| match (a, b) {
        (Displacement(_), Gap(_) | Symmetry) | (Symmetry, Gap(_)) => {
            Some([a, b].map(|of| format!("a {}", of.name())))
        }
        (Displacement([Some(_), Some(_)]), Load(_)) => {
            let both = "both displacements prescribed (no component is \"free\")".to_owned();
            Some([both, format!("a {}", b.name())])
        }
        _ => None,
    };
    let mut pairs = a.iter().flat_map(|a| b.iter().map(move |b| (a, b)));
    pairs.find_map(|(a, b)| one_way(a, b).or_else(|| one_way(b, a).map(|[b, a]| [a, b])))
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct BoundaryKeys {
    name: String,
    r#where: Option<Expression>,
    displacement: Option<[toml::Value; 2]>,
    symmetry: bool,
    gap: Option<Expression>,
    normal: Option<[Expression; 2]>,
    traction: Option<[Expression; 2]>,
    pressure: Option<Expression>,
}

pub(super) fn boundary(keys: BoundaryKeys) -> Result<Boundary, Diagnostic> {
    let prescribed = |value: toml::Value| match value.as_str() {
        Some("free") => Ok(None),
        _ => value.try_into().map(Some).map_err(is_wrong),
    };
    let displacement = match keys.displacement {
        Some([x, y]) => Some([prescribed(x)?, prescribed(y)?]),
        None => None,
    };
    if let Some([None, None]) = displacement {
        let problem = "is \"free\" in both components; leave it out".to_owned();
        return Err(("displacement", problem));
    }
    if keys.r#where.as_ref().is_some_and(Expression::depends_on_time) {
        return Err(("where", "depends on t; it selects a part of the undeformed body".to_owned()));
    }
    if keys.normal.is_some() && keys.gap.is_none() {
        return Err(("normal", "needs a gap beside it".to_owned()));
    }
    let normal = keys.normal.map(unit_vector).transpose()?;
    let conditions = [
        displacement.map(Condition::Displacement),
        keys.symmetry.then_some(Condition::Symmetry),
        keys.gap.map(|distance| Condition::Gap(Gap { distance, normal })),
        keys.traction.map(|f| Condition::Load(SurfaceLoad::Traction(f))),
        keys.pressure.map(|p| Condition::Load(SurfaceLoad::Pressure(p))),
    ];
    let conditions: Vec<_> = conditions.into_iter().flatten().collect();
    if let Some([one, other]) = contradiction(&conditions, &conditions) {
        let problem = format!(
            "has {one} and {other}; an edge can have only one of them: give the other to another boundary, which may \
             end at this one"
        );
        return Err(("", problem));
    }
    if conditions.is_empty() {
        let choices =
            keys_of_element("boundary").filter(|key| !["name", "where", "normal"].contains(key));
        let choices = choices.collect::<Vec<_>>().join(", ");
        return Err(("", format!("has nothing in it: give it one of {choices}, or remove it")));
    }
    Ok(Boundary { name: keys.name, selection: keys.r#where, conditions })
}

/// A constant direction, scaled to length 1.
fn unit_vector(direction: [Expression; 2]) -> Result<[f64; 2], Diagnostic> {
    let [x, y] = direction.map(|component| component.eval(0.0, 0.0, 0.0));
    let length = x.hypot(y);
    match length > 0.0 && length.is_finite() {
        true => Ok([x / length, y / length]),
        false => Err(("normal", "has no direction: its length is zero".to_owned())),
    }
}
