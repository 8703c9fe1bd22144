//! The residual and the error of a damage step (28).

use super::{Body, Mass};

/// The accuracy of ζ_n in (28), from the residual r = (M + kκL)ζ_n − Mζ_{n−1} − kb.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct DamageCertificate {
    /// ‖r‖₂ over the norm of the right-hand side (its mass lumped).
    pub residual: f64,
    /// The error of the mean of ζ_n, |1ᵀ(M(ζ_n − ζ_{n−1}) − kb)| / |Ω|: as 1ᵀL = 0, diffusion neither makes
    /// nor removes damage.
    pub balance: f64,
    /// An upper bound of the error of the solve in ζ_n at any node.
    pub error: f64,
}

impl DamageCertificate {
    /// For ζ_{n−1} = `before` and ζ_n = `after`, a step k = `step`, s, the source load b = `load`
    /// and the diffusions κ of the materials, m²/s. Collective.
    ///
    /// The residual is summed triangle by triangle, without the matrices of the solver. On a
    /// triangle T the least eigenvalue of M, |T|/12 [2 1 1; 1 2 1; 1 1 2], is a quarter of that of
    /// the lumped mass |T|/3. So M + kκL ≥ M ≥ ¼W with W the diagonal matrix of the node areas w,
    /// and the error e satisfies √w_i |e_i| ≤ ‖e‖_W ≤ 4 ‖W^-½ r‖; for the lumped mass, where
    /// M = W, the 4 is 1.
    ///
    /// If diffusion dominates, the rounding of ζ_n in kκLζ_n makes a large residual. Then a smaller bound is
    /// the sum of three terms: the balance, the same bound for the part of r above this rounding, and the
    /// rounding times the condition of L, about N for N vertices (Bank and Scott, *On the conditioning of
    /// finite element equations with highly refined meshes*).
    pub fn of(
        body: &Body,
        mass: Mass,
        diffusions: &[f64],
        step: f64,
        load: &[f64],
        [before, after]: [&[f64]; 2],
    ) -> Self {
        let residual = residual(body, mass, (step, diffusions), [before, after]);
        let mut sums = [0.0; 5];
        let (mut least, mut largest) = (f64::INFINITY, 0.0_f64);
        for i in 0..body.vertices.partition.owned() {
            let (area, b) = (body.vertices.weights[i], step * load[i]);
            let [r, rounding] = [residual[i][0] - b, residual[i][1]];
            let above = (r.abs() - rounding).max(0.0);
            let change = area * (after[i] - before[i]);
            let right = area * before[i] + b;
            let terms = [r * r, right * right, change - b, r * r / area, above * above / area];
            sums.iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
            (least, largest) = (area.min(least), largest.max(after[i].abs()));
        }
        let comm = body.comm();
        comm.sum(&mut sums);
        let [squares, rhs, balance, weighted, above] = sums;
        let (balance, least) = (balance.abs() / body.area, comm.min(least));
        let rounding = f64::EPSILON * body.vertices.partition.total() as f64 * comm.max(largest);
        let ratio = match mass {
            Mass::Consistent => 4.0,
            Mass::Lumped => 1.0,
        };
        let bound = |weighted: f64| ratio * (weighted / least).sqrt();
        Self {
            residual: (squares / rhs.max(f64::MIN_POSITIVE)).sqrt(),
            balance,
            error: bound(weighted).min(balance + bound(above) + rounding),
        }
    }
}

/// M(ζ_n − ζ_{n−1}) + kκL ζ_n, summed over the triangles, with k, s, and the κ of the materials, m²/s;
/// and the rounding of ζ_n in it, ε kκ Σ_T |T| |∇λ_i| Σ_j |∇λ_j| |ζ_j|.
fn residual(
    body: &Body,
    mass: Mass,
    (step, diffusions): (f64, &[f64]),
    [before, after]: [&[f64]; 2],
) -> Vec<[f64; 2]> {
    let mut residual = vec![[0.0; 2]; after.len()];
    let triangles = body.mesh.triangles.iter().zip(&body.triangles);
    for (t, (nodes, triangle)) in triangles.enumerate() {
        let spread = step * diffusions[body.material(t)];
        let zeta = nodes.map(|node| after[node]);
        let change: [f64; 3] = std::array::from_fn(|i| zeta[i] - before[nodes[i]]);
        // (Mv)_i is |T|/12 (Σ_j v_j + v_i) for the consistent mass and |T|/3 v_i for the lumped.
        let (sum, own) = match mass {
            Mass::Consistent => (change[0] + change[1] + change[2], triangle.area() / 12.0),
            Mass::Lumped => (0.0, triangle.area() / 3.0),
        };
        let gradients = triangle.gradients();
        // Σ_j ∇λ_j = 0: differences of ζ are exact where it hardly varies.
        let flux = [0, 1].map(|axis| {
            let slope = |i: usize| (zeta[i] - zeta[0]) * gradients[i][axis];
            spread * triangle.area() * (slope(1) + slope(2))
        });
        let steepness = gradients.map(|[dx, dy]| (dx * dx + dy * dy).sqrt());
        let rounding: f64 = zeta.iter().zip(steepness).map(|(z, steep)| steep * z.abs()).sum();
        let rounding = f64::EPSILON * spread * triangle.area() * rounding;
        for (i, (node, [dx, dy])) in nodes.iter().zip(gradients).enumerate() {
            let [r, of_rounding] = &mut residual[*node];
            *r += own * (sum + change[i]) + dx * flux[0] + dy * flux[1];
            *of_rounding += steepness[i] * rounding;
        }
    }
    residual
}
