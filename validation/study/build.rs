//! The library's PETSc may be in a folder where the system does not look.

fn main() {
    let folders = std::env::var("DEP_PETSC_RPATH").unwrap_or_default();
    for folder in folders.split(':').filter(|folder| !folder.is_empty()) {
        println!("cargo::rustc-link-arg=-Wl,-rpath,{folder}");
    }
}
