//! Finds PETSc, MPI, CHOLMOD, LAPACK and BLAS, and declares an explicit list of their functions to Rust.
//!
//! pkg-config knows PETSc: that of `PETSC_DIR` and `PETSC_ARCH`, else of `PKG_CONFIG_PATH`, else the system's. The
//! compiler that built PETSc (mpicc) knows MPI. A PETSc that was built without MPI has a stand-in for it (MPIUNI); then the cfg
//! `petsc_without_mpi` is set. Without an interface to CHOLMOD in PETSc `petsc_without_cholmod` is set. What is missing is told in one sentence.

use std::{env, fs, panic, path::PathBuf, process::Command};

/// Everything the `petsc` module calls. A name that is not here does not exist for us.
const PETSC: &str = "\
    PetscInitialize|PetscInitialized|PetscGetVersionNumber|PetscFinalize|PetscPushErrorHandler|\
    PetscOptionsInsertString|PetscOptionsSetValue|PetscOptionsHasName|\
    PetscOptionsLeftGet|PetscOptionsLeftRestore|\
    PetscLogStageGetId|PetscLogStageRegister|PetscLogStagePush|PetscLogStagePop|\
    MPI_Comm_size|MPI_Comm_rank|MPI_Allreduce|MPI_Bcast|MPI_Type_contiguous|MPI_Type_commit|MPI_Type_free|\
    MPI_Ibarrier|MPI_Test|MPI_Abort|omp_set_max_active_levels|mallopt|dtrsm_|fork|waitpid|dup2|dlsym|\
    PetscSFCreate|PetscSFDestroy|PetscSFSetGraph|PetscSFBcastBegin|PetscSFBcastEnd|\
    MatPartitioningCreate|MatPartitioningDestroy|MatPartitioningSetType|\
    MatPartitioningSetAdjacency|MatPartitioningSetFromOptions|MatPartitioningApply|\
    ISAllGather|ISGetIndices|ISRestoreIndices|ISDestroy|\
    VecCreateMPI|VecGetLocalSize|VecDestroy|VecGetArray|VecRestoreArray|VecGetArrayRead|\
    VecRestoreArrayRead|VecAXPBY|VecDot|VecNorm|\
    MatCreate|MatDestroy|MatSetSizes|MatSetType|MatSetBlockSize|MatSetOption|\
    MatSeqAIJSetPreallocationCSR|MatMPIAIJSetPreallocationCSR|MatMult|MatDuplicate|MatCopy|MatGetDiagonal|MatCreateVecs|\
    MatAXPY|MatScale|MatShift|MatAssemblyBegin|MatAssemblyEnd|\
    MatDiagonalSet|MatZeroRowsColumns|MatGetOwnershipRange|MatGetSize|MatGetInfo|\
    MatGetRow|MatRestoreRow|PetscObjectTypeCompare|MatMPIAIJGetSeqAIJ|MatSeqAIJGetArray|\
    MatSeqAIJRestoreArray|MatSeqAIJGetArrayRead|MatSeqAIJRestoreArrayRead|\
    MatCreateShell|MatShellSetOperation|MatShellGetContext|MatNullSpaceCreate|MatNullSpaceDestroy|MatSetNearNullSpace|MatGetNearNullSpace|\
    KSPCreate|KSPDestroy|KSPSetType|KSPSetOptionsPrefix|KSPSetFromOptions|KSPSetOperators|KSPSolve|\
    KSPGetType|KSPSetConvergenceTest|KSPSetNormType|KSPBuildResidual|KSPBuildSolution|KSPGetConvergedReasonString|KSPGetIterationNumber|KSPGetPC|KSPSetTolerances|KSPGetTolerances|\
    PCRegister|PCCreate_Shell|PCSetType|PCSetUp|PCSetReusePreconditioner|PCGetOperators|PCGetFailedReason|\
    PCFactorSetMatSolverType|\
    PCSetApplicationContext|PCGetApplicationContext|PCShellSetApply|PCShellSetSetUp|PCShellSetName|\
    TaoCreate|TaoDestroy|TaoSetType|TaoSetSolution|TaoSetVariableBounds|\
    TaoSetObjectiveAndGradient|TaoSetHessian|TaoSetFromOptions|TaoSetTolerances|\
    TaoSetMaximumIterations|TaoSolve|TaoGetIterationNumber|TaoGetConvergedReason|TaoGetLinearSolveIterations|TaoGetKSP";

/// Everything the `linear` module calls.
const CHOLMOD: &str = "\
    cholmod_l_start|cholmod_l_finish|cholmod_l_analyze_p|cholmod_l_factorize|\
    cholmod_l_camd|cholmod_l_change_factor|cholmod_l_free_factor|cholmod_l_realloc|\
    dpotrf_|dpotrs_";

/// MPI's constants that the `petsc` module uses: type, name, and Open MPI's variable.
const MPI: [[&str; 3]; 5] = [
    ["Datatype", "DOUBLE", "ompi_mpi_double"],
    ["Datatype", "BYTE", "ompi_mpi_byte"],
    ["Op", "SUM", "ompi_mpi_op_sum"],
    ["Op", "MAX", "ompi_mpi_op_max"],
    ["Op", "REPLACE", "ompi_mpi_op_replace"],
];

const OTHER: &str = "set PETSC_DIR or PKG_CONFIG_PATH to another one";

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rustc-check-cfg=cfg(petsc_without_mpi, petsc_without_cholmod)");
    for name in ["PETSC_DIR", "PETSC_ARCH", "PKG_CONFIG_PATH", "PKG_CONFIG"] {
        println!("cargo::rerun-if-env-changed={name}");
    }
    if let Err(message) = find_and_declare() {
        println!("cargo::error={}", message.split_whitespace().collect::<Vec<_>>().join(" "));
    }
}

fn find_and_declare() -> Result<(), String> {
    let known = |package: &str| pkg_config(&["--cflags", "--libs", package]);
    let system = |libraries: &[&str]| libraries.iter().map(|name| format!("-l{name}")).collect();
    let petsc = known("petsc >= 3.18").or_else(|e| known("PETSc >= 3.18").map_err(|_| e));
    let mut words = petsc.map_err(|e| {
        format!("PETSc was not found ({e}); run `make deps` (Debian: petsc-dev), or {OTHER}")
    })?;
    let without_mpi = check_configuration(&words)?;
    if without_mpi {
        println!("cargo::rustc-cfg=petsc_without_mpi");
    } else {
        words.extend(mpi()?);
    }
    words.extend(known("CHOLMOD").unwrap_or_else(|_| system(&["cholmod"])));
    let lapack = known("lapack blas").or_else(|_| known("openblas"));
    words.extend(lapack.unwrap_or_else(|_| system(&["lapack", "blas"])));
    let linux = env::var("CARGO_CFG_TARGET_OS").is_ok_and(|system| system == "linux");
    if linux {
        words.push("-lgomp".into());
    }
    link(&words);

    let flags = |word: &&String| word.starts_with("-I") || word.starts_with("-D");
    let flags: Vec<String> = words.iter().filter(flags).cloned().collect();
    let variables =
        "PETSC_COMM_WORLD|M_ARENA_MAX|M_MMAP_MAX|M_MMAP_THRESHOLD|ompi_mpi_\\w+|SIGNORINI_\\w+";
    let values = MPI
        .map(|[kind, name, _]| format!("static const MPI_{kind} SIGNORINI_{name} = MPI_{name};\n"));
    let headers = format!(
        "#include <petsctao.h>\n#include <petscsf.h>\n#include <dlfcn.h>\n#include <sys/wait.h>\n#include <unistd.h>\n{}\
         #ifndef OPEN_MPI\n{}#endif\n\
         void omp_set_max_active_levels(int);\n\
         void dtrsm_(const char *, const char *, const char *, const char *, const int *, const int *,\
         const double *, const double *, const int *, double *, const int *);\n\
         PETSC_EXTERN PetscErrorCode PCCreate_Shell(PC);\n",
        if linux { "#include <malloc.h>\n" } else { "" },
        values.concat()
    );
    let declarations = declare("petsc", &headers, &flags, PETSC, variables)?;
    // The constants are addresses of variables in Open MPI, and integers in MPICH.
    let is_open_mpi = declarations.contains(MPI[0][2]);
    let constants = MPI.map(|[kind, name, variable]| match is_open_mpi {
        true => format!(
            "pub const MPI_{name}: MPI_{kind} = (&raw const {variable}).cast_mut().cast();\n"
        ),
        false => format!("pub const MPI_{name}: MPI_{kind} = SIGNORINI_{name};\n"),
    });
    write("petsc", &(declarations + &constants.concat()))?;

    let variables = "CHOLMOD_(LONG|REAL|DOUBLE|SUPERNODAL|GIVEN|NATURAL|PATTERN|OUT_OF_MEMORY|TOO_LARGE|\
                     INVALID)";
    let headers = "#if __has_include(<suitesparse/cholmod.h>)\n#include <suitesparse/cholmod.h>\n\
                   #else\n#include <cholmod.h>\n#endif\n\
                   void dpotrf_(const char *, const int *, double *, const int *, int *);\n\
                   void dpotrs_(const char *, const int *, const int *, const double *, const int *, double *,\
                   const int *, int *);\n";
    write("cholmod", &declare("cholmod", headers, &flags, CHOLMOD, variables)?)
}

/// The words by which the compiler that built PETSc finds MPI.
fn mpi() -> Result<Vec<String>, String> {
    let known = |package: &str| pkg_config(&["--cflags", "--libs", package]);
    let compiler = pkg_config(&["--variable=ccompiler", "petsc"]).unwrap_or_default().join("");
    words_of(&compiler, &["-show"], None)
        .or_else(|_| words_of("mpicc", &["-show"], None))
        .or_else(|e| known("mpi-c").or_else(|_| known("mpich")).map_err(|_| e))
        .map_err(|e| format!("MPI was not found ({e}); run `make deps` (Debian: libopenmpi-dev)"))
}

/// Was PETSc built without MPI? One sentence if it was built with numbers of other types. Runs on several processes use MPI, MUMPS and
/// PTScotch.
fn check_configuration(words: &[String]) -> Result<bool, String> {
    let folders = words.iter().filter_map(|word| word.strip_prefix("-I"));
    let files = folders.map(|folder| PathBuf::from(folder).join("petscconf.h"));
    let (file, text) = files
        .filter_map(|file| Some((file.display().to_string(), fs::read_to_string(&file).ok()?)))
        .next()
        .ok_or_else(|| format!("PETSc's petscconf.h was not found; {OTHER}"))?;
    let has = |name: &&str| text.lines().any(|line| line.split_whitespace().nth(1) == Some(name));
    let numbers = ["COMPLEX", "64BIT_INDICES", "REAL_SINGLE", "REAL___FP16", "REAL___FLOAT128"];
    let numbers = numbers.map(|name| format!("PETSC_USE_{name}"));
    if let Some(name) = numbers.iter().map(String::as_str).find(has) {
        let needed = "needed is real double with 32-bit indices";
        return Err(format!("{file} has {name}; {needed}; {OTHER}"));
    }
    if !has(&"PETSC_HAVE_SUITESPARSE") {
        println!("cargo::rustc-cfg=petsc_without_cholmod");
    }
    if has(&"PETSC_HAVE_MPIUNI") {
        println!("cargo::warning={file} is without MPI: runs will have one process");
        return Ok(true);
    }
    for name in ["PETSC_HAVE_MUMPS", "PETSC_HAVE_PTSCOTCH"].iter().filter(|name| !has(name)) {
        println!("cargo::warning={file} lacks {name}, which runs on several processes need");
    }
    Ok(false)
}

/// The words that pkg-config prints. It looks in the folder of `PETSC_DIR` first.
fn pkg_config(arguments: &[&str]) -> Result<Vec<String>, String> {
    let mut path = env::var("PKG_CONFIG_PATH").unwrap_or_default();
    if let Ok(folder) = env::var("PETSC_DIR") {
        let folder = PathBuf::from(folder).join(env::var("PETSC_ARCH").unwrap_or_default());
        let folder = folder.join("lib/pkgconfig");
        if !["petsc.pc", "PETSc.pc"].iter().any(|file| folder.join(file).exists()) {
            let folder = folder.display();
            return Err(format!("{folder} of PETSC_DIR and PETSC_ARCH has no petsc.pc"));
        }
        path = format!("{}:{path}", folder.display());
    }
    let program = env::var("PKG_CONFIG").unwrap_or("pkg-config".into());
    words_of(&program, arguments, Some(&path))
}

/// The words that a program prints, or its name and last complaint.
fn words_of(program: &str, arguments: &[&str], path: Option<&str>) -> Result<Vec<String>, String> {
    let mut command = Command::new(program);
    let output = command.args(arguments).envs(path.map(|path| ("PKG_CONFIG_PATH", path))).output();
    let output = output.map_err(|e| format!("{program}: {e}"))?;
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    if !output.status.success() {
        let complaint = text(&output.stderr).lines().last().unwrap_or("it failed").to_owned();
        return Err(format!("{program} {}: {complaint}", arguments.join(" ")));
    }
    Ok(text(&output.stdout).split_whitespace().map(str::to_owned).collect())
}

/// Passes libraries and their folders to the linker. Programs find shared libraries at run time also in folders that are not the
/// system's (rpath). `DEP_PETSC_RPATH` names these folders to the build scripts of packages that use this one.
fn link(words: &[String]) {
    words.iter().filter_map(|word| word.strip_prefix("-l")).for_each(|library| {
        println!("cargo::rustc-link-lib={library}");
    });
    let mut own = Vec::new();
    for folder in words.iter().filter_map(|word| word.strip_prefix("-L")) {
        println!("cargo::rustc-link-search=native={folder}");
        let is_system = ["/usr/lib", "/lib"].iter().any(|system| folder.starts_with(system));
        if !is_system && has_shared_libraries(folder) {
            println!("cargo::rustc-link-arg=-Wl,-rpath,{folder}");
            own.push(folder);
        }
    }
    println!("cargo::metadata=RPATH={}", own.join(":"));
}

/// Whether a folder has a library that is loaded at run time; a folder that cannot be read may have one.
fn has_shared_libraries(folder: &str) -> bool {
    let is_shared = |name: &str| name.ends_with(".so") || name.ends_with(".dylib");
    let mut files = match fs::read_dir(folder) {
        Ok(files) => files.flatten(),
        Err(_) => return true,
    };
    files.any(|file| file.file_name().to_str().is_some_and(is_shared))
}

/// The Rust declarations of some C functions and variables.
fn declare(
    name: &str,
    headers: &str,
    flags: &[String],
    functions: &str,
    variables: &str,
) -> Result<String, String> {
    let builder = bindgen::Builder::default()
        .header_contents(&format!("{name}_headers.h"), headers)
        .clang_args(flags)
        .allowlist_function(functions)
        .allowlist_var(variables)
        .default_enum_style(bindgen::EnumVariation::ModuleConsts)
        .layout_tests(false)
        .generate_comments(false)
        .derive_default(true);
    // bindgen panics if there is no libclang.
    panic::set_hook(Box::new(|_| {}));
    let declarations = panic::catch_unwind(panic::AssertUnwindSafe(|| builder.generate()));
    match declarations {
        Ok(Ok(declarations)) => Ok(declarations.to_string()),
        Ok(Err(e)) => Err(format!("the headers of {name} could not be read ({e}); {OTHER}")),
        Err(_) => Err("libclang was not found; run `make deps` (Debian: libclang-dev)".into()),
    }
}

/// Writes the declarations for `petsc::raw` or `linear`.
fn write(name: &str, declarations: &str) -> Result<(), String> {
    let file = PathBuf::from(env::var("OUT_DIR").unwrap_or_default()).join(format!("{name}.rs"));
    fs::write(&file, declarations).map_err(|e| format!("{}: {e}", file.display()))
}
