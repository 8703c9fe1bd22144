//! Dividing a mesh among the ranks (<https://petsc.org/release/manualpages/MatOrderings/>).

use super::{Matrix, Pattern, PetscError, Session, check, handle::Handle, raw, session::world};
use std::{ptr, slice};

/// The rank of each of `nodes` nodes so that all have about as many and few of the pairs of
/// neighbours that `cells` (their nodes) make are cut (PTScotch, a parallel multilevel method).
/// Every rank knows the graph and learns the answer. Collective.
pub(crate) fn divide(
    session: &Session,
    nodes: usize,
    cells: &[[usize; 3]],
) -> Result<Vec<usize>, PetscError> {
    let comm = session.comm();
    // Each rank passes an equal part of the rows of the adjacency matrix.
    let (start, end) = (nodes * comm.rank() / comm.size(), nodes * (comm.rank() + 1) / comm.size());
    let couples = cells.iter().flat_map(|cell| cell.iter().flat_map(|&i| cell.map(|j| (i, j))));
    let own = couples.filter(|(i, _)| (start..end).contains(i));
    let pattern = Pattern::new(end - start, own.map(|(i, j)| (i - start, j as i32)));
    let links = vec![1.0; pattern.entries()];
    let graph = Matrix::with_pattern(session, 1, &pattern, &links)?;

    let mut indices = ptr::null();
    // SAFETY: fresh handles and a live matrix; the gathered set has `nodes` indices, lent until
    // they are given back.
    unsafe {
        let create = |handle| raw::MatPartitioningCreate(world(), handle);
        let partitioning = Handle::new(raw::MatPartitioningDestroy, create)?;
        check(raw::MatPartitioningSetAdjacency(partitioning.raw(), graph.raw()))?;
        check(raw::MatPartitioningSetType(partitioning.raw(), c"ptscotch".as_ptr()))?;
        check(raw::MatPartitioningSetFromOptions(partitioning.raw()))?;
        let apply = |handle| raw::MatPartitioningApply(partitioning.raw(), handle);
        let own = Handle::new(raw::ISDestroy, apply)?;
        let all = Handle::new(raw::ISDestroy, |handle| raw::ISAllGather(own.raw(), handle))?;
        check(raw::ISGetIndices(all.raw(), &mut indices))?;
        let owner = slice::from_raw_parts(indices, nodes).iter().map(|&r| r as usize).collect();
        check(raw::ISRestoreIndices(all.raw(), &mut indices))?;
        Ok(owner)
    }
}
