//! Dividing a graph among the ranks.

use super::{Matrix, PetscError, Session, check, raw, session::world};
use std::{ptr, slice};

/// The rank of each of `nodes` nodes so that all have about as many and few of the pairs of
/// neighbours that `cells` (their nodes) make are cut (PTScotch, a parallel multilevel method).
/// Every rank knows the graph and learns the answer. Collective.
///
/// # Errors
/// This PETSc has no PTScotch, or fails.
pub fn divide(
    session: &Session,
    nodes: usize,
    cells: &[[usize; 3]],
) -> Result<Vec<usize>, PetscError> {
    let comm = session.comm();
    // Each rank gives the rows of an even share.
    let (start, end) = (nodes * comm.rank() / comm.size(), nodes * (comm.rank() + 1) / comm.size());
    let (mut rows, mut columns) = (Vec::new(), Vec::new());
    for cell in cells {
        for &i in cell.iter().filter(|i| (start..end).contains(i)) {
            rows.extend([i as i32; 3]);
            columns.extend(cell.map(|j| j as i32));
        }
    }
    let links = vec![1.0; rows.len()];
    let mut graph = Matrix::with_pattern(session, end - start, 1, rows, columns)?;
    graph.set_values(&links)?;

    let mut partitioning = ptr::null_mut();
    let (mut share, mut whole, mut indices) = (ptr::null_mut(), ptr::null_mut(), ptr::null());
    // SAFETY: fresh handles and a live matrix; the gathered set has `nodes` indices, lent until
    // they are given back.
    unsafe {
        check(raw::MatPartitioningCreate(world(), &mut partitioning))?;
        check(raw::MatPartitioningSetAdjacency(partitioning, graph.raw))?;
        check(raw::MatPartitioningSetType(partitioning, c"ptscotch".as_ptr()))?;
        check(raw::MatPartitioningSetFromOptions(partitioning))?;
        check(raw::MatPartitioningApply(partitioning, &mut share))?;
        check(raw::ISAllGather(share, &mut whole))?;
        check(raw::ISGetIndices(whole, &mut indices))?;
        let owner = slice::from_raw_parts(indices, nodes).iter().map(|&r| r as usize).collect();
        check(raw::ISRestoreIndices(whole, &mut indices))?;
        check(raw::ISDestroy(&mut whole))?;
        check(raw::ISDestroy(&mut share))?;
        check(raw::MatPartitioningDestroy(&mut partitioning))?;
        Ok(owner)
    }
}
