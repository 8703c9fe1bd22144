//! Displacement conditions that make no problem.

use super::constraints::DEPENDENT;

/// Conditions at a node that cannot hold together.
#[derive(Debug, Clone, thiserror::Error)]
pub enum ConstraintError {
    /// A prescribed displacement goes through the obstacle.
    #[error(
        "the displacement prescribed at node ({x}, {y}) goes {depth:.3e} m through the obstacle \
         there: a node that is both held and in contact keeps its prescribed value, which must \
         respect the gap"
    )]
    Penetrates {
        /// Coordinates of the node.
        x: f64,
        /// Coordinates of the node.
        y: f64,
        /// How far beyond the gap, m.
        depth: f64,
    },
    /// Two prescribed values contradict each other.
    #[error(
        "two boundaries prescribe different displacements at their common node ({x}, {y}): \
         {first} and {second} m along ({dx:.3}, {dy:.3})"
    )]
    Contradicts {
        /// Coordinates of the node.
        x: f64,
        /// Coordinates of the node.
        y: f64,
        /// The value kept, m.
        first: f64,
        /// The value that differs, m.
        second: f64,
        /// The common direction.
        dx: f64,
        /// The common direction.
        dy: f64,
    },
    /// Two obstacles leave a node no place.
    #[error(
        "the obstacles on both sides of node ({x}, {y}) leave it no room: it would have to be {depth:.3e} m \
         inside one of them; widen a gap or change the displacement prescribed there"
    )]
    NoRoom {
        /// Coordinates of the node.
        x: f64,
        /// Coordinates of the node.
        y: f64,
        /// How much the gaps lack, m.
        depth: f64,
    },
    /// Directions too near to each other to be unknowns of their own, too far apart to be one.
    #[error(
        "two conditions at node ({x}, {y}) (prescribed directions or contact normals) differ from \
         one line by an angle of only {angle:.1e}: double precision cannot tell their effects apart; \
         open the wedge there beyond {DEPENDENT:e} rad, or let one boundary end before the node"
    )]
    Dependent {
        /// Coordinates of the node.
        x: f64,
        /// Coordinates of the node.
        y: f64,
        /// The angle between the directions' lines, rad.
        angle: f64,
    },
    /// More independent conditions than the two unknowns of a node.
    #[error(
        "more than two independent conditions (prescribed directions and contact normals) meet at \
         node ({x}, {y}): a node of the plane has two unknowns; free one of them or separate \
         the boundaries"
    )]
    TooMany {
        /// Coordinates of the node.
        x: f64,
        /// Coordinates of the node.
        y: f64,
    },
}
