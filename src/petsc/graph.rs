//! Dividing a mesh among the ranks (<https://petsc.org/release/manualpages/MatOrderings/>).

use super::{
    Matrix, Pattern, PetscError, Session, check, handle::Handle, raw, session::world, vector::lent,
};
use std::ptr;

/// Divides `nodes` nodes among the ranks (PTScotch, a parallel multilevel method). All ranks get about the
/// same number of nodes, and few edges between nodes of one cell are cut. `cells` lists the nodes of each
/// cell. Every rank passes the whole graph and gets the rank of every node. Collective.
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
    // SAFETY: fresh handles and a live matrix; PETSc lends the `nodes` indices of the gathered set until
    // they are restored.
    unsafe {
        let create = |handle| raw::MatPartitioningCreate(world(), handle);
        let partitioning = Handle::new(raw::MatPartitioningDestroy, create)?;
        check(raw::MatPartitioningSetAdjacency(partitioning.raw(), graph.stored()))?;
        let chosen = check(raw::MatPartitioningSetType(partitioning.raw(), c"ptscotch".as_ptr()));
        chosen.map_err(|_| PetscError::ours("several processes need a PETSc with PTScotch"))?;
        check(raw::MatPartitioningSetFromOptions(partitioning.raw()))?;
        let apply = |handle| raw::MatPartitioningApply(partitioning.raw(), handle);
        let own = Handle::new(raw::ISDestroy, apply)?;
        let all = Handle::new(raw::ISDestroy, |handle| raw::ISAllGather(own.raw(), handle))?;
        check(raw::ISGetIndices(all.raw(), &mut indices))?;
        let owner = lent(indices, nodes).iter().map(|&r| r as usize).collect();
        check(raw::ISRestoreIndices(all.raw(), &mut indices))?;
        Ok(owner)
    }
}
