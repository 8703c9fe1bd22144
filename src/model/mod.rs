//! The paper's laws at one point of the body: plane elasticity ([`Material`]) and the damage source
//! ([`DamageLaw`]). Numbers come in and go out; nothing here knows meshes or time. A source of another author implements
//! [`DamageSource`]; a constant that scenes set is a change here and in `geo/scene.schema.json`, from which KEYS is made.

mod damage;
mod elasticity;

pub use damage::{ChosenSource, DamageLaw, DamagePoint, DamageSource, Fremond};
pub use elasticity::{Material, Plane, von_mises};
