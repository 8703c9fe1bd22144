//! The damage source φ of the paper's section 4 with its truncations q* and η_*.

use nalgebra::Vector3;
use serde::Deserialize;
use std::rc::Rc;

/// A point of the body at which the source φ is evaluated.
#[derive(Debug, Clone, Copy)]
pub struct DamagePoint<'a> {
    /// The coordinates (x, y) of the point, m.
    pub place: [f64; 2],
    /// The strain (ε_xx, ε_yy, 2ε_xy).
    pub strain: &'a Vector3<f64>,
    /// The damage ζ.
    pub zeta: f64,
    /// The constants κ, λ_D, λ_U, λ_W, q* and ζ_* of the material. A source that needs E and ν brings its own.
    pub law: &'a DamageLaw,
}

/// A damage source φ in (3). A scene gives the constants κ, λ_D, λ_U, λ_W, q* and ζ_*; a source may use them in its own
/// way and have others. The paper's is [`Fremond`].
pub trait DamageSource {
    /// φ(ε, ζ) ≤ 0 at a point, 1/s.
    fn source(&self, point: &DamagePoint) -> f64;

    /// The name of the law in messages; by default the name of its type.
    fn name(&self) -> &'static str {
        std::any::type_name::<Self>()
    }

    /// The change of the source from φ = `source` < 0, 1/s, if ζ changes from the first to the second value of `zeta` and
    /// |ε|² by the factor `stretch`. The errors of the time steps grow by it. The default, [`DamageLaw::source_change`], holds for every
    /// φ = −(λ_D (1 − ζ)/ζ + Ψ(ε) − λ_W)₊ with a quadratic Ψ.
    fn source_change(&self, law: &DamageLaw, source: f64, zeta: [f64; 2], stretch: f64) -> f64 {
        law.source_change(source, zeta, stretch)
    }
}

/// The damage source of the paper, [`DamageLaw::source`].
#[derive(Debug, Clone, Copy)]
pub struct Fremond;

impl DamageSource for Fremond {
    #[inline]
    fn source(&self, point: &DamagePoint) -> f64 {
        point.law.source(point.strain, point.zeta)
    }
}

/// The damage source of a run. A scene gets its own by `RunOptions::of`.
#[derive(Clone)]
pub enum ChosenSource {
    /// The paper's.
    Fremond,
    /// A source that another author wrote.
    Own(Rc<dyn DamageSource>),
}

impl DamageSource for ChosenSource {
    /// The source is the same in all calls, so that the paper's becomes part of a loop over triangles.
    #[inline]
    fn source(&self, point: &DamagePoint) -> f64 {
        match self {
            Self::Fremond => Fremond.source(point),
            Self::Own(source) => source.source(point),
        }
    }

    fn source_change(&self, law: &DamageLaw, source: f64, zeta: [f64; 2], stretch: f64) -> f64 {
        match self {
            Self::Fremond => Fremond.source_change(law, source, zeta, stretch),
            Self::Own(own) => own.source_change(law, source, zeta, stretch),
        }
    }

    fn name(&self) -> &'static str {
        match self {
            Self::Fremond => Fremond.name(),
            Self::Own(source) => source.name(),
        }
    }
}

/// The constants of equation (3), and the source φ of Frémond that the paper takes.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct DamageLaw {
    /// Damage diffusion κ > 0, m²/s.
    pub diffusion: f64,
    /// λ_D, 1/s.
    pub lambda_d: f64,
    /// λ_U, 1/s.
    pub lambda_u: f64,
    /// λ_W, 1/s.
    pub lambda_w: f64,
    /// q*, the upper bound of |ε|² in the source: Ψ_q*(ε) = min(|ε|², q*).
    pub strain_cap: f64,
    /// ζ_* in (0, 1), the smallest admissible ζ.
    pub threshold: f64,
}

impl DamageLaw {
    /// The source φ(ε, ζ) = −(λ_D (1−ζ)/ζ + ½ λ_U Ψ_q*(ε) − λ_W)₊ ≤ 0, 1/s,
    /// from the strain (ε_xx, ε_yy, 2ε_xy) and ζ, with |ε|² = Σ ε_ij²; ζ is truncated by η_* as in equation (3).
    #[inline]
    pub fn source(&self, strain: &Vector3<f64>, zeta: f64) -> f64 {
        let (zeta, [xx, yy, twice_xy]) = (self.truncate(zeta), strain.as_ref());
        let psi = (xx * xx + yy * yy + 0.5 * twice_xy * twice_xy).min(self.strain_cap);
        let rate = self.lambda_d * (1.0 - zeta) / zeta + 0.5 * self.lambda_u * psi - self.lambda_w;
        -rate.max(0.0)
    }

    /// The change of the source from φ = `source` < 0, 1/s, if ζ changes from the first to the second value and
    /// Ψ becomes `stretch` Ψ. It follows from ½ λ_U Ψ = λ_W − φ − λ_D (1−ζ)/ζ.
    pub fn source_change(&self, source: f64, [from, to]: [f64; 2], stretch: f64) -> f64 {
        let internal = [from, to].map(|zeta| self.lambda_d * (1.0 - zeta) / zeta);
        let external = (self.lambda_w - source - internal[0]).max(0.0);
        let changed = internal[1] + stretch * external - self.lambda_w;
        (internal[0] + external - self.lambda_w) - changed.max(0.0)
    }

    /// η_*(ζ): ζ cut to [ζ_*, 1].
    pub fn truncate(&self, zeta: f64) -> f64 {
        zeta.clamp(self.threshold, 1.0)
    }
}
