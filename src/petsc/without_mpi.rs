//! The calls of MPI in a program whose PETSc was built without MPI (MPIUNI): there is one rank.

use super::raw::{MPI_Comm, MPI_Datatype, MPI_Op};
use std::ffi::{c_int, c_void};

pub unsafe fn MPI_Comm_rank(_: MPI_Comm, rank: *mut c_int) -> c_int {
    // SAFETY: the caller passes a valid pointer, as to MPI.
    unsafe { *rank = 0 };
    0
}

pub unsafe fn MPI_Comm_size(_: MPI_Comm, size: *mut c_int) -> c_int {
    // SAFETY: the caller passes a valid pointer, as to MPI.
    unsafe { *size = 1 };
    0
}

/// Calls that only several ranks make.
macro_rules! of_several_ranks {
    ($($name:ident($($argument:ty),*);)*) => {
        $(pub unsafe fn $name($(_: $argument),*) -> c_int {
            unreachable!(concat!(stringify!($name), " on one rank"))
        })*
    };
}

of_several_ranks! {
    MPI_Abort(MPI_Comm, c_int);
    MPI_Allreduce(*const c_void, *mut c_void, c_int, MPI_Datatype, MPI_Op, MPI_Comm);
    MPI_Bcast(*mut c_void, c_int, MPI_Datatype, c_int, MPI_Comm);
    MPI_Ibarrier(MPI_Comm, *mut c_int);
    MPI_Test(*mut c_int, *mut c_int, *mut c_int);
    MPI_Type_commit(*mut MPI_Datatype);
    MPI_Type_contiguous(c_int, MPI_Datatype, *mut MPI_Datatype);
    MPI_Type_free(*mut MPI_Datatype);
}
