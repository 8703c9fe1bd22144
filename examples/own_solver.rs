//! Your own contact solver in the loop of signorini, here projected successive over-relaxation.
//!
//! `cargo run --example own_solver` presses a block, which is damaged meanwhile, on a wavy foundation. It compares the
//! answers with those of the default solver. Your crate needs `signorini` in its Cargo.toml, and nothing else.

use signorini::{
    contact::{ContactError, ContactProblem, ContactReport, ContactSolver},
    estimate::Simulation,
    linear::LinearSolver,
    mesh::Mesh,
    observe::ObservedProblem,
    petsc::{Session, Vector},
    scene::Scene,
};

/// Relaxes the unknowns c of min ½ cᵀKc − fᵀc, lower ≤ c ≤ upper, in turn (Cryer, SIAM J. Control 9, 1971):
///
/// c_i ← cut(c_i + ω (f_i − Σ_j K_ij c_j) / K_ii)
///
/// It works on one rank and for bodies that are held.
pub struct ProjectedSor {
    /// ω in (0, 2).
    pub relaxation: f64,
}

impl ContactSolver for ProjectedSor {
    fn name(&self) -> &'static str {
        "projected-sor"
    }

    fn solve(
        &self,
        problem: &ContactProblem,
        _elastic: &mut LinearSolver, // solves K x = r, for methods that need it
        _warm: &mut Vec<f64>,        // whatever the method wants to remember until the next step
        c: &mut Vector,
    ) -> Result<ContactReport, ContactError> {
        let load = problem.load.read(<[f64]>::to_vec)?;
        let mut x = c.read(<[f64]>::to_vec)?;
        let mut bounds = vec![[f64::NEG_INFINITY, f64::INFINITY]; x.len()];
        for bound in problem.bounds {
            bounds[bound.dof] = [bound.lower, bound.upper];
        }
        let mut report = ContactReport::default();
        let rows = problem.stiffness.assembled_rows()?;
        for _ in 0..100_000 {
            report.iterations += 1;
            for i in 0..x.len() {
                let [lower, upper] = bounds[i];
                // Row i of K gives r = f_i − Σ_j K_ij c_j and K_ii.
                let (r, diagonal) = rows.read(i as i32, |columns, values| {
                    let row = columns.iter().map(|&j| j as usize).zip(values);
                    row.fold((load[i], 0.0), |(r, diagonal), (j, k)| {
                        (r - k * x[j], if j == i { *k } else { diagonal })
                    })
                })?;
                x[i] = (x[i] + self.relaxation * r / diagonal).clamp(lower, upper);
            }
            c.set(&x)?;
            // The KKT residuals, which the certificate of the program computes again in its own way.
            if problem.residuals(c)?.worst() <= problem.tolerance {
                return Ok(report);
            }
        }
        let residuals = problem.residuals(c)?;
        Err(ContactError::stopped(self.name(), report, residuals, "too many iterations"))
    }
}

/// The scene: a block 1 m × 1 m, held at its left, pressed on a wavy foundation.
pub const SCENE: &str = r#"
mesh.file = "block.msh"
material = { young = 1000, poisson = 0.3, plane = "stress" }
damage = { diffusion = 0.1, lambda_d = 0.1, lambda_u = 5000, lambda_w = 0, strain_cap = 1, threshold = 0.05 }
time = { end = 1, step = 0.1 }
boundary = [
    { name = "left", displacement = [0, 0] },
    { name = "bottom", gap = "0.001 + 0.001*cos(9*x)" },
    { name = "top", pressure = "5*t" },
]
"#;

/// Runs the scene by both solvers.
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let scene = Scene::parse(SCENE, "block.toml".as_ref(), &[])?;
    let problem = ObservedProblem::new(scene, Mesh::rectangle(1.0, 1.0, 12, 12))?;
    let session = Session::start(&[])?;
    let own = Box::new(ProjectedSor { relaxation: 1.7 });
    let own = Simulation::new(&problem).solver(own).run(&session)?;
    let ours = Simulation::new(&problem).run(&session)?;
    for note in own.notes(&problem) {
        println!("{note}");
    }
    let ([own, ours], mut difference) = ([own.last, ours.last], 0.0_f64);
    for (own, ours) in own.state.u.iter().zip(&ours.state.u) {
        difference = difference.max((own - ours).abs());
    }
    println!(
        "iterations of the last step: {} and {}",
        own.report.iterations, ours.report.iterations
    );
    println!("contact force: {} and {} N/m", own.record.contact_force, ours.record.contact_force);
    assert_eq!(own.report.rescued_by, None, "the solver's own answer counts");
    let largest = ours.record.displacement_max;
    assert!(difference < 1e-8 * largest, "u differs by {difference} m of {largest} m");
    Ok(())
}

#[cfg(test)]
#[test]
fn both_solvers_agree() {
    main().unwrap();
}
