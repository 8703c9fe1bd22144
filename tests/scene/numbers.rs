//! Numbers out of range, a case for every rule.

use crate::errors::check;

#[test]
fn every_rule_names_file_line_and_key() {
    check(&[
        // Mesh.
        ("size = 0.25", "size = 0", &["bad.toml:4: mesh.size must be positive (m), but is 0"]),
        ("grading = 3", "grading = inf", &["bad.toml:5: mesh.parameters.grading must be finite"]),
        ("grading = 3", "size = 3", &["bad.toml:4: mesh.size is given a second time"]),
        ("base.geo", "base.msh", &["bad.toml:4: mesh.size has no effect", "name its .geo"]),
        ("base.geo", "base.step", &["bad.toml:3: mesh.file must be a .geo or .msh file"]),
        // Material.
        (
            "young = 1e6",
            "young = -3",
            &["bad.toml:7: material.young must be positive, at most 1e100 (Pa), but is -3"],
        ),
        (
            "young = 1e6",
            "young = 1e308",
            &["young must be positive, at most 1e100 (Pa), but is 1e308"],
        ),
        ("young = 1e6", "young = 0", &["bad.toml:7: material.young must be positive"]),
        ("young = 1e6", "young = nan", &["bad.toml:7: material.young must be positive", "nan"]),
        ("young = 1e6", "young = inf", &["bad.toml:7: material.young must be positive", "inf"]),
        (
            "poisson = 0.3",
            "poisson = 0.5",
            &["bad.toml:8: material.poisson must be between -1 and"],
        ),
        ("poisson = 0.3", "poisson = -1", &["bad.toml:8: material.poisson must be between -1 and"]),
        // Discretisation.
        (
            "[material]",
            "[discretisation]\ndisplacement = 3\n[material]",
            &["bad.toml:7: discretisation.displacement must be 1 or 2, but is 3"],
        ),
        (
            "[material]",
            "[discretisation]\ndisplacement = 1.5\n[material]",
            &["bad.toml:7: discretisation.displacement must be 1 or 2, but is 1.5"],
        ),
        // Damage.
        ("diffusion = 1.0", "diffusion = 0", &["bad.toml:11: damage.diffusion must be positive"]),
        ("lambda_d = 0.25", "lambda_d = -1", &["bad.toml:12: damage.lambda_d must be at least 0"]),
        ("lambda_u = 1e3", "lambda_u = -1", &["bad.toml:13: damage.lambda_u must be at least 0"]),
        ("lambda_w = 0.0", "lambda_w = -1", &["bad.toml:14: damage.lambda_w must be at least 0"]),
        ("cap = 1000.0", "cap = 0", &["bad.toml:15: damage.strain_cap must be positive"]),
        (
            "threshold = 0.01",
            "threshold = 0",
            &["bad.toml:16: damage.threshold must be between 0 and"],
        ),
        (
            "threshold = 0.01",
            "threshold = 1",
            &["bad.toml:16: damage.threshold must be between 0 and"],
        ),
        ("1 - 0.1*x", "1 - 0.1*t", &["bad.toml:17: damage.initial depends on t"]),
        ("1 - 0.1*x", "1.5", &["bad.toml:17: damage.initial must be in (0.01, 1], but is 1.5"]),
        ("1 - 0.1*x", "0.01", &["bad.toml:17: damage.initial must be in (0.01, 1], but is 0.01"]),
        ("1 - 0.1*x", "1 - 0.1*z", &["bad.toml:17: damage.initial has the unknown variable `z`"]),
        ("1 - 0.1*x", "1 - (x", &["bad.toml:17: damage.initial has the end at column 7"]),
        // Time.
        ("end = 1.0", "end = 0", &["bad.toml:19: time.end must be positive (s), but is 0"]),
        ("end = 1.0", "end = inf", &["bad.toml:19: time.end must be positive"]),
        (
            "step = 0.01",
            "step = 0",
            &["bad.toml:20: time.step must be positive (s), or \"auto\", but is 0"],
        ),
        (
            "step = 0.01",
            "step = 1.5",
            &["bad.toml:20: time.step must be positive and at most the end, 1 s, but is 1.5"],
        ),
        ("step = 0.01", "step = 1e-300", &["bad.toml:20: time.step is", "more than 1e9 steps"]),
        // Contact.
        ("1e-8", "0", &["bad.toml:25: contact.tolerance must be between 0 and 1"]),
        ("1e-8", "1.0", &["bad.toml:25: contact.tolerance must be between 0 and 1"]),
    ]);
}
