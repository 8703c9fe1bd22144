//! Declares Debian's PETSc, MPI and CHOLMOD to Rust: an explicit list of functions, nothing else.

use std::{env, path::PathBuf, process::Command};

/// Everything the `petsc` module calls. A name that is not here does not exist for us.
const FUNCTIONS: &str = "\
    PetscInitialize|PetscInitialized|PetscFinalize|PetscPushErrorHandler|\
    PetscOptionsInsertString|PetscOptionsSetValue|PetscOptionsHasName|\
    PetscOptionsLeftGet|PetscOptionsLeftRestore|\
    MPI_Comm_size|MPI_Comm_rank|MPI_Allreduce|MPI_Type_contiguous|MPI_Type_commit|MPI_Type_free|\
    MPI_Ibarrier|MPI_Test|MPI_Abort|mallopt|omp_set_max_active_levels|\
    PetscSFCreate|PetscSFDestroy|PetscSFSetGraph|PetscSFBcastBegin|PetscSFBcastEnd|\
    cholmod_l_start|cholmod_l_finish|cholmod_l_analyze|cholmod_l_analyze_p|cholmod_l_factorize|\
    cholmod_l_change_factor|cholmod_l_free_factor|\
    MatPartitioningCreate|MatPartitioningDestroy|MatPartitioningSetType|\
    MatPartitioningSetAdjacency|MatPartitioningSetFromOptions|MatPartitioningApply|\
    ISAllGather|ISGetIndices|ISRestoreIndices|ISDestroy|\
    VecCreateMPI|VecGetLocalSize|VecDestroy|VecGetArray|VecRestoreArray|VecGetArrayRead|\
    VecRestoreArrayRead|VecAXPY|VecAYPX|VecCopy|VecDot|VecNorm|\
    MatCreate|MatDestroy|MatSetSizes|MatSetType|MatSetBlockSize|MatSetOption|\
    MatSetPreallocationCOO|MatSetValuesCOO|MatMult|MatDuplicate|MatCopy|MatAXPY|MatScale|MatShift|\
    MatDiagonalSet|MatZeroRowsColumns|MatGetOwnershipRange|MatGetSize|MatGetInfo|MatMumpsGetInfog|\
    MatGetRow|MatRestoreRow|\
    MatNullSpaceCreate|MatNullSpaceDestroy|MatSetNearNullSpace|MatGetNearNullSpace|\
    KSPCreate|KSPDestroy|KSPSetOperators|KSPSetType|KSPGetPC|KSPSetUp|KSPSolve|\
    KSPSetTolerances|KSPGetConvergedReason|KSPGetIterationNumber|KSPSetFromOptions|\
    KSPSetOptionsPrefix|KSPSetNormType|KSPSetInitialGuessNonzero|\
    PCCreate|PCDestroy|PCSetType|PCSetOptionsPrefix|PCSetFromOptions|PCSetOperators|PCSetUp|PCApply|\
    PCFactorSetMatSolverType|PCFactorGetMatrix|PCFactorGetMatSolverType|PCGetFailedReason|PCGetType|\
    PCReset|PCSetReusePreconditioner|PCGetOperators|PCShellSetContext|PCShellGetContext|\
    PCShellSetApply|PCShellSetSetUp|\
    TaoCreate|TaoDestroy|TaoSetType|TaoSetSolution|TaoSetVariableBounds|\
    TaoSetObjectiveAndGradient|TaoSetHessian|TaoSetFromOptions|TaoSetTolerances|\
    TaoSetMaximumIterations|TaoSolve|TaoGetSolutionStatus|TaoGetLinearSolveIterations|TaoGetKSP";

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    let petsc = pkg_config::probe_library("petsc").unwrap_or_else(|e| {
        panic!("PETSc was not found by pkg-config; run `make deps` (Debian: petsc-dev)\n{e}")
    });
    println!("cargo:rustc-link-lib=mpi");
    println!("cargo:rustc-link-lib=cholmod");
    println!("cargo:rustc-link-lib=gomp");

    let mpi_flags = Command::new("mpicc")
        .arg("--showme:compile")
        .output()
        .expect("mpicc did not run; `make deps` installs it (Debian: libopenmpi-dev)");
    let mpi_flags = String::from_utf8_lossy(&mpi_flags.stdout).into_owned();

    bindgen::Builder::default()
        .header_contents(
            "signorini.h",
            "#include <petsctao.h>\n#include <petscsf.h>\n#include <suitesparse/cholmod.h>\n\
             #include <malloc.h>\nvoid omp_set_max_active_levels(int);\n",
        )
        .clang_args(petsc.include_paths.iter().map(|p| format!("-I{}", p.display())))
        .clang_args(mpi_flags.split_whitespace())
        .allowlist_function(FUNCTIONS)
        .allowlist_var("PETSC_COMM_WORLD|M_MMAP_MAX|M_MMAP_THRESHOLD|M_TRIM_THRESHOLD")
        // Debian's MPI is Open MPI, whose constants are the addresses of these.
        .allowlist_var("CHOLMOD_(LONG|REAL|DOUBLE|SUPERNODAL|GIVEN|PATTERN)")
        .allowlist_var("ompi_mpi_double|ompi_mpi_op_(sum|max|replace)")
        .default_enum_style(bindgen::EnumVariation::ModuleConsts)
        .layout_tests(false)
        .generate_comments(false)
        .generate()
        .expect("bindgen could not read petsctao.h (Debian: petsc-dev, libclang-dev)")
        .write_to_file(PathBuf::from(env::var("OUT_DIR").unwrap_or_default()).join("petsc.rs"))
        .expect("the build directory is writable");
}
