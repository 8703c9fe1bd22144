//! Declares Debian's PETSc, MPI and CHOLMOD to Rust: an explicit list of functions, nothing else.

use std::{env, path::PathBuf, process::Command};

/// Everything the `petsc` module calls. A name that is not here does not exist for us.
const PETSC: &str = "\
    PetscInitialize|PetscInitialized|PetscGetVersionNumber|PetscFinalize|PetscPushErrorHandler|\
    PetscOptionsInsertString|PetscOptionsSetValue|PetscOptionsHasName|\
    PetscOptionsLeftGet|PetscOptionsLeftRestore|\
    MPI_Comm_size|MPI_Comm_rank|MPI_Allreduce|MPI_Bcast|MPI_Type_contiguous|MPI_Type_commit|MPI_Type_free|\
    MPI_Ibarrier|MPI_Test|MPI_Abort|omp_set_max_active_levels|mallopt|dtrsm_|\
    PetscSFCreate|PetscSFDestroy|PetscSFSetGraph|PetscSFBcastBegin|PetscSFBcastEnd|\
    MatPartitioningCreate|MatPartitioningDestroy|MatPartitioningSetType|\
    MatPartitioningSetAdjacency|MatPartitioningSetFromOptions|MatPartitioningApply|\
    ISAllGather|ISGetIndices|ISRestoreIndices|ISDestroy|\
    VecCreateMPI|VecGetLocalSize|VecDestroy|VecGetArray|VecRestoreArray|VecGetArrayRead|\
    VecRestoreArrayRead|VecAXPBY|VecDot|VecNorm|\
    MatCreate|MatDestroy|MatSetSizes|MatSetType|MatSetBlockSize|MatSetOption|\
    MatSeqAIJSetPreallocationCSR|MatMPIAIJSetPreallocationCSR|MatMult|MatDuplicate|MatCopy|MatGetDiagonal|MatCreateVecs|\
    MatAXPY|MatScale|MatShift|MatAssemblyBegin|MatAssemblyEnd|\
    MatDiagonalSet|MatZeroRowsColumns|MatGetOwnershipRange|MatGetSize|MatGetInfo|MatMumpsGetInfog|\
    MatGetRow|MatRestoreRow|PetscObjectTypeCompare|MatMPIAIJGetSeqAIJ|MatSeqAIJGetArray|\
    MatSeqAIJRestoreArray|MatSeqAIJGetArrayRead|MatSeqAIJRestoreArrayRead|\
    MatCreateShell|MatShellSetOperation|MatShellGetContext|MatNullSpaceCreate|MatNullSpaceDestroy|MatSetNearNullSpace|MatGetNearNullSpace|\
    KSPCreate|KSPDestroy|KSPSetType|KSPSetOptionsPrefix|KSPSetFromOptions|KSPSetOperators|KSPSolve|\
    KSPSetConvergenceTest|KSPSetNormType|KSPBuildResidual|KSPBuildSolution|KSPGetConvergedReasonString|KSPGetIterationNumber|KSPGetPC|KSPSetTolerances|KSPGetTolerances|\
    PCRegister|PCCreate_Shell|PCSetType|PCSetUp|PCSetReusePreconditioner|PCGetOperators|PCGetFailedReason|\
    PCFactorSetMatSolverType|PCFactorGetMatrix|PCFactorGetMatSolverType|\
    PCSetApplicationContext|PCGetApplicationContext|PCShellSetApply|PCShellSetSetUp|PCShellSetName|\
    TaoCreate|TaoDestroy|TaoSetType|TaoSetSolution|TaoSetVariableBounds|\
    TaoSetObjectiveAndGradient|TaoSetHessian|TaoSetFromOptions|TaoSetTolerances|\
    TaoSetMaximumIterations|TaoSolve|TaoGetIterationNumber|TaoGetConvergedReason|TaoGetLinearSolveIterations|TaoGetKSP";

/// Everything the `linear` module calls.
const CHOLMOD: &str = "\
    cholmod_l_start|cholmod_l_finish|cholmod_l_analyze|cholmod_l_analyze_p|cholmod_l_factorize|\
    cholmod_l_camd|cholmod_l_metis|cholmod_l_change_factor|cholmod_l_free_factor|cholmod_l_realloc|\
    dpotrf_|dpotrs_";

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    let petsc = pkg_config::probe_library("petsc").unwrap_or_else(|e| {
        panic!("PETSc was not found by pkg-config; run `make deps` (Debian: petsc-dev)\n{e}")
    });
    println!("cargo:rustc-link-lib=mpi");
    println!("cargo:rustc-link-lib=cholmod");
    println!("cargo:rustc-link-lib=gomp");
    println!("cargo:rustc-link-lib=lapack");
    println!("cargo:rustc-link-lib=blas");

    let mpi_flags = Command::new("mpicc")
        .arg("--showme:compile")
        .output()
        .expect("mpicc did not run; `make deps` installs it (Debian: libopenmpi-dev)");
    let mpi_flags = String::from_utf8_lossy(&mpi_flags.stdout).into_owned();

    let mut flags: Vec<String> =
        petsc.include_paths.iter().map(|path| format!("-I{}", path.display())).collect();
    flags.extend(mpi_flags.split_whitespace().map(str::to_owned));
    // Debian's MPI is Open MPI, whose constants are the addresses of variables.
    let variables =
        "PETSC_COMM_WORLD|M_ARENA_MAX|ompi_mpi_(double|byte)|ompi_mpi_op_(sum|max|replace)";
    let headers = "#include <petsctao.h>\n#include <petscsf.h>\n#include <malloc.h>\n\
                   void omp_set_max_active_levels(int);\n\
                   void dtrsm_(const char *, const char *, const char *, const char *, const int *, const int *,\
                   const double *, const double *, const int *, double *, const int *);\n\
                   PETSC_EXTERN PetscErrorCode PCCreate_Shell(PC);\n";
    declare("petsc", headers, &flags, PETSC, variables);
    let variables = "CHOLMOD_(LONG|REAL|DOUBLE|SUPERNODAL|GIVEN|NATURAL|PATTERN|OUT_OF_MEMORY|TOO_LARGE|\
                     INVALID)";
    let headers = "#include <suitesparse/cholmod.h>\n\
                   void dpotrf_(const char *, const int *, double *, const int *, int *);\n\
                   void dpotrs_(const char *, const int *, const int *, const double *, const int *, double *,\
                   const int *, int *);\n";
    declare("cholmod", headers, &[], CHOLMOD, variables);
}

/// Writes the Rust declarations of some C functions and variables to `OUT_DIR/name.rs`.
fn declare(name: &str, headers: &str, flags: &[String], functions: &str, variables: &str) {
    let file = PathBuf::from(env::var("OUT_DIR").unwrap_or_default()).join(format!("{name}.rs"));
    bindgen::Builder::default()
        .header_contents(&format!("{name}_headers.h"), headers)
        .clang_args(flags)
        .allowlist_function(functions)
        .allowlist_var(variables)
        .default_enum_style(bindgen::EnumVariation::ModuleConsts)
        .layout_tests(false)
        .generate_comments(false)
        .derive_default(true)
        .generate()
        .unwrap_or_else(|e| {
            panic!("bindgen could not read the headers of {name}; run `make deps`\n{e}")
        })
        .write_to_file(file)
        .expect("the build directory is writable");
}
