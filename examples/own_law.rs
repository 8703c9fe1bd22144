//! Your own damage law in the loop of signorini, here one by which only tension damages.
//!
//! The paper's source φ = −(λ_D (1 − ζ)/ζ + ½ λ_U min(|ε|², q*) − λ_W)₊ does not distinguish tension and compression.
//! `cargo run --example own_law` presses and pulls a block by both laws. Where all strains are tensile they agree. Then a mesh
//! is made for an accuracy, and a run on it prints the figures with their bars.

use signorini::{
    accuracy::adapted,
    estimate::Simulation,
    evolution::RunOptions,
    mesh::Mesh,
    model::{DamagePoint, DamageSource},
    nalgebra::{Matrix2, Vector3},
    observe::ObservedProblem,
    petsc::Session,
    scene::Scene,
};

/// The paper's source with the positive parts of the principal strains in place of ε: |ε₊|² = Σ max(ε_i, 0)².
pub struct TensionOnly;

impl DamageSource for TensionOnly {
    fn source(&self, point: &DamagePoint) -> f64 {
        let [xx, yy, twice_xy] = (*point.strain).into();
        let strain = Matrix2::new(xx, 0.5 * twice_xy, 0.5 * twice_xy, yy);
        // A strain of the same |ε₊|², in the axes of the principal strains.
        let tensile = strain.symmetric_eigenvalues().map(|principal| principal.max(0.0));
        point.law.source(&Vector3::new(tensile[0], tensile[1], 0.0), point.zeta)
    }
}

/// A block 1 m × 1 m between two symmetry axes under `traction`, Pa, on its top, and unsupported at its right.
fn block(traction: &str) -> Result<Scene, Box<dyn std::error::Error>> {
    let text = format!(
        r#"
        mesh.file = "block.msh"
        material = {{ young = 100, poisson = 0, plane = "stress" }}
        damage = {{ diffusion = 1e-3, lambda_d = 0, lambda_u = 20, lambda_w = 0, strain_cap = 1, threshold = 0.05 }}
        time = {{ end = 1, step = 0.1 }}
        boundary = [
            {{ name = "left", symmetry = true }},
            {{ name = "bottom", symmetry = true }},
            {{ name = "top", traction = [0, "{traction}"] }},
        ]
        "#
    );
    Ok(Scene::parse(&text, "block.toml".as_ref(), &[])?)
}

/// Runs the block pulled and pressed.
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let session = Session::start(&[])?;
    let mesh = Mesh::rectangle(1.0, 1.0, 4, 4);
    for (what, traction) in [("pulled", "5"), ("pressed", "-5")] {
        let problem = ObservedProblem::new(block(traction)?, mesh.clone())?;
        let own = Simulation::new(&problem).law(Box::new(TensionOnly)).run(&session)?;
        let ours = Simulation::new(&problem).run(&session)?;
        let [own, ours] = [own, ours].map(|outcome| outcome.last.record.zeta_min);
        println!("{what}: min ζ = {own} by tension only, {ours} by the paper's law");
        assert!(ours < 0.98, "the paper's law damages under both loads");
        let expected = if what == "pulled" { ours } else { 1.0 };
        assert!((own - expected).abs() < 1e-12);
    }
    let scene = block("5 - 10*x")?;
    let run_options = RunOptions::of(&scene).law(Box::new(TensionOnly));
    let adapted = adapted(&session, &scene, mesh, &run_options, 0.05, &mut |_| {})?;
    let problem = ObservedProblem::new(scene, adapted.mesh)?;
    let mut outcome = Simulation::new(&problem).run_options(&run_options).run(&session)?;
    outcome.set_bars(&problem, &adapted.measured)?;
    for (figure, value) in problem.figures.iter().zip(&outcome.last.figures) {
        if let Some(bar) = outcome.bars.iter().find(|bar| bar.name == figure.name) {
            println!("{}: {} ± {}", figure.name, value.value, bar.bar);
        }
    }
    assert!(outcome.bars.iter().any(|bar| bar.name == "zeta_min"));
    Ok(())
}

#[cfg(test)]
#[test]
fn they_agree_in_tension_and_compression_does_no_damage() {
    main().unwrap();
}
