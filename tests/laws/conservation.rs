//! Diffusion neither makes nor removes damage: 1ᵀL = 0, so the mean of ζ over the body changes
//! by the source alone, 1ᵀM(ζ_n − ζ_{n−1}) = k 1ᵀb, however large κk is.

use crate::support::{Random, distorted, history, shipped};
use signorini::{
    contact::SOLVERS,
    fem::{Body, DamageCertificate, DamageSystem, Mass, source, source_load},
    mesh::Order,
    model::Fremond,
    petsc::Session,
};

#[test]
fn the_mean_changes_by_the_source_alone_however_large_the_diffusion() {
    let (session, body) = (Session::start(&[]).unwrap(), Body::new(distorted(9), Order::Linear));
    let (nodes, areas) = (body.mesh.nodes.len(), &body.vertices.weights);
    let mut random = Random::new(5);
    let before: Vec<f64> = random.field(nodes).iter().map(|v| 0.6 + 0.3 * v).collect();
    let load: Vec<f64> =
        random.field(nodes).iter().zip(areas).map(|(v, area)| -v.abs() * area).collect();
    let integral = |value: &dyn Fn(usize) -> f64| (0..nodes).map(value).sum::<f64>();
    for (mass, diffusion) in [Mass::Consistent, Mass::Lumped]
        .into_iter()
        .flat_map(|m| [1.0, 1e8, 1e11, 1e14].map(|d| (m, d)))
    {
        let step = 0.1;
        let mut system = DamageSystem::new(&session, &body, mass, &[diffusion], step).unwrap();
        let mut after = before.clone();
        assert!(system.advance(&load, &mut after).unwrap());
        let correction = system.correction(&load).unwrap().unwrap();
        let added = step * load.iter().sum::<f64>();
        let changes = [
            integral(&|i| areas[i] * (after[i] - before[i])),
            integral(&|i| areas[i] * correction[i]),
        ];
        for change in changes {
            assert!((change - added).abs() < 1e-13, "{mass:?} {diffusion:e}: {change} {added}");
        }
        // The certificate sees what the residual does not.
        let certify = |zeta: &[f64]| {
            DamageCertificate::of(&body, mass, &[diffusion], step, &load, [&before, zeta])
        };
        let good = certify(&after);
        assert!(good.balance < 1e-13 && good.error < 1e-10, "{diffusion:e}: {good:?}");
        after.iter_mut().for_each(|z| *z += 1e-6);
        let shifted = certify(&after);
        assert!((shifted.balance - 1e-6).abs() < 1e-12, "{diffusion:e}: {shifted:?}");
        assert!((1e-6..1e-3).contains(&shifted.error), "{diffusion:e}: {shifted:?}");
    }
}

/// Errors of ζ diffuse as ζ itself does without a source, with the factor of the system and with one of another step.
#[test]
fn two_fields_diffuse_as_zeta_does() {
    let (session, body) = (Session::start(&[]).unwrap(), Body::new(distorted(9), Order::Linear));
    let nodes = body.mesh.nodes.len();
    let mut random = Random::new(6);
    let fields = [random.field(nodes), random.field(nodes)];
    for diffusion in [1e-3, 1.0, 1e8] {
        let mass = Mass::Consistent;
        let mut system = DamageSystem::new(&session, &body, mass, &[diffusion], 0.1).unwrap();
        // The first call makes the factor, which then serves both fields at once.
        let mut unused = fields.clone();
        assert!(system.diffuse(&mut unused.each_mut().map(|of| &mut of[..])).unwrap());
        let mut diffused = fields.clone();
        assert!(system.diffuse(&mut diffused.each_mut().map(|of| &mut of[..])).unwrap());
        system.set_step(0.15).unwrap();
        let mut of_later = fields.clone();
        assert!(system.diffuse(&mut of_later.each_mut().map(|of| &mut of[..])).unwrap());
        for (step, found) in [(0.1, diffused), (0.15, of_later)] {
            let new = || DamageSystem::new(&session, &body, mass, &[diffusion], step).unwrap();
            for (field, found) in fields.iter().zip(&found) {
                let mut exact = field.clone();
                assert!(new().advance(&vec![0.0; nodes], &mut exact).unwrap());
                let off = exact.iter().zip(found).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                assert!(off < 1e-5, "{diffusion:e}, {step}: {off:e}");
            }
        }
    }
}

/// Testing (28) with 1: ∫ζ_n − ∫ζ_{n−1} = k ∫φ_{n−1}, also where diffusion makes the damage uniform.
#[test]
fn the_loss_of_damage_in_a_run_is_the_integral_of_the_source() {
    let mean = |set: &str| {
        let scene = shipped("square-mild", &["mesh.size=0.125", "time.step=0.1", set]);
        let (steps, outcome) = history(&scene, SOLVERS[0]);
        let (body, laws) = (&scene.body, scene.damage().unwrap());
        for pair in steps.windows(2) {
            let state = &pair[0].state;
            let phi = source(body, (&Fremond, laws), &body.strains(&state.u), &state.zeta)
                .expect("φ ≤ 0");
            let load = source_load(body, scene.mass(), &phi);
            let added = 0.1 * load.iter().sum::<f64>() / body.area;
            let change = pair[1].record.zeta_mean - pair[0].record.zeta_mean;
            assert!(added < -1e-4 && (change - added).abs() < 1e-13, "{set}: {change} {added}");
        }
        assert!(steps.iter().all(|step| step.record.zeta_error < 1e-12), "{set}");
        let notes = outcome.notes(&scene);
        (
            steps.last().unwrap().record.zeta_mean,
            notes.iter().any(|note| note.contains("ζ left the range")),
        )
    };
    for set in ["damage.mass=consistent", "damage.mass=lumped", "discretisation.displacement=2"] {
        mean(set);
    }
    let [limit, others @ ..] = ["1e8", "1e10", "1e12", "1e14"]
        .map(|diffusion| mean(&format!("damage.diffusion={diffusion}")));
    for (mean, notes_bounds) in others {
        assert!((mean - limit.0).abs() < 1e-9 && !notes_bounds && !limit.1, "{mean}");
    }
}
