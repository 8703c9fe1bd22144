//! The file a reference solution is kept in: one zlib stream of the hash of what the states belong
//! to, then u and ζ of each state as little-endian doubles; zlib's checksum ends it.

use super::{Fields, StudyError};
use flate2::{Compression, read::ZlibDecoder, write::ZlibEncoder};
use signorini::output::write_whole;
use std::{
    fs::File,
    io::{self, ErrorKind, Read, Write},
    path::{Path, PathBuf},
};

/// The hash of what the states of a file belong to: scene, mesh, steps and times.
pub(super) type Hash = [u8; 32];

/// A reference solution cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ReferenceError {
    /// It has not been computed.
    #[error(
        "{path}: there is no such reference yet; compute it with `signorini-study reference` and \
         the same options",
        path = .0.display()
    )]
    Missing(PathBuf),
    /// It belongs to another scene or mesh, or the file is damaged: which, says the text.
    #[error(
        "{path}: {1}; `signorini-study reference` with the same options computes it anew",
        path = .0.display()
    )]
    Useless(PathBuf, String),
    /// The file cannot be opened, or its content not be made.
    #[error("{path}: {1}", path = .0.display())]
    Io(PathBuf, io::Error),
}

/// Writes the states whole or not at all.
pub(super) fn write(path: &Path, hash: &Hash, states: &[Fields]) -> Result<(), StudyError> {
    let compressed = || {
        let mut stream = ZlibEncoder::new(Vec::new(), Compression::fast());
        stream.write_all(hash)?;
        for state in states {
            let numbers = state.u.iter().chain(&state.zeta);
            let bytes: Vec<u8> = numbers.flat_map(|number| number.to_le_bytes()).collect();
            stream.write_all(&bytes)?;
        }
        stream.finish()
    };
    let content = compressed().map_err(|error| ReferenceError::Io(path.to_owned(), error))?;
    Ok(write_whole(path, &content)?)
}

/// Reads so many states on so many `nodes`, which [`write`] wrote with this `hash`.
pub(super) fn read(
    path: &Path,
    hash: &Hash,
    states: usize,
    nodes: usize,
) -> Result<Vec<Fields>, ReferenceError> {
    let useless = |reason: String| Err(ReferenceError::Useless(path.to_owned(), reason));
    let file = File::open(path).map_err(|error| match error.kind() {
        ErrorKind::NotFound => ReferenceError::Missing(path.to_owned()),
        _ => ReferenceError::Io(path.to_owned(), error),
    })?;
    let mut content = Vec::new();
    if let Err(error) = ZlibDecoder::new(file).read_to_end(&mut content) {
        return useless(format!("the file is damaged ({error})"));
    }
    let length = hash.len() + states * 3 * nodes * size_of::<f64>();
    match content.split_first_chunk() {
        Some((found, _)) if found != hash => {
            useless("this reference belongs to another scene or mesh".to_owned())
        }
        Some((_, bytes)) if content.len() == length => Ok(fields(bytes, nodes)),
        _ => useless("the file is damaged (it ends too early)".to_owned()),
    }
}

/// The states that `bytes` are, on so many `nodes`.
fn fields(bytes: &[u8], nodes: usize) -> Vec<Fields> {
    let (numbers, _) = bytes.as_chunks();
    let numbers: Vec<f64> = numbers.iter().map(|&number| f64::from_le_bytes(number)).collect();
    let fields = |state: &[f64]| {
        let (u, zeta) = state.split_at(2 * nodes);
        Fields { u: u.to_vec(), zeta: zeta.to_vec() }
    };
    numbers.chunks_exact(3 * nodes).map(fields).collect()
}
