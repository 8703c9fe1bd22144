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
         the same options"
    )]
    Missing {
        /// The file.
        path: PathBuf,
    },
    /// It belongs to another problem.
    #[error(
        "{path}: this reference belongs to another scene or mesh; `signorini-study reference` with \
         the same options computes it anew"
    )]
    Foreign {
        /// The file.
        path: PathBuf,
    },
    /// The file is not what was written.
    #[error(
        "{path}: the file is damaged ({reason}); `signorini-study reference` with the same options \
         computes it anew"
    )]
    Damaged {
        /// The file.
        path: PathBuf,
        /// In what way.
        reason: String,
    },
    /// The file cannot be opened, or its content not be made.
    #[error("{path}: {source}")]
    Io {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
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
    let io = |source| ReferenceError::Io { path: path.to_owned(), source };
    Ok(write_whole(path, &compressed().map_err(io)?)?)
}

/// Reads so many states on so many `nodes`, which [`write`] wrote with this `hash`.
pub(super) fn read(
    path: &Path,
    hash: &Hash,
    states: usize,
    nodes: usize,
) -> Result<Vec<Fields>, ReferenceError> {
    let path = path.to_owned();
    let file = match File::open(&path) {
        Ok(file) => file,
        Err(e) if e.kind() == ErrorKind::NotFound => return Err(ReferenceError::Missing { path }),
        Err(source) => return Err(ReferenceError::Io { path, source }),
    };
    let mut content = Vec::new();
    if let Err(error) = ZlibDecoder::new(file).read_to_end(&mut content) {
        return Err(ReferenceError::Damaged { path, reason: error.to_string() });
    }
    let Some(bytes) = content.strip_prefix(hash.as_slice()) else {
        return Err(ReferenceError::Foreign { path });
    };
    if bytes.len() != states * 3 * nodes * size_of::<f64>() {
        let reason = format!("it has not the {states} states of {nodes} nodes");
        return Err(ReferenceError::Damaged { path, reason });
    }
    let (numbers, _) = bytes.as_chunks();
    let numbers: Vec<f64> = numbers.iter().map(|&number| f64::from_le_bytes(number)).collect();
    let fields = |state: &[f64]| {
        let (u, zeta) = state.split_at(2 * nodes);
        Fields { u: u.to_vec(), zeta: zeta.to_vec() }
    };
    Ok(numbers.chunks_exact(3 * nodes).map(fields).collect())
}
