//! Files of states: a line of JSON that says what they belong to, then the numbers in one zlib
//! stream, whose checksum ends it.

use super::Fields;
use crate::output::{OutputError, write_whole};
use flate2::{Compression, read::ZlibDecoder, write::ZlibEncoder};
use serde::{Deserialize, Serialize};
use std::{
    fs::File,
    io::{BufRead, BufReader, ErrorKind, Read, Write},
    path::{Path, PathBuf},
};

/// What the states of a file belong to.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Label {
    /// Of scene, mesh and times.
    pub(super) hash: String,
    /// How many.
    pub(super) states: usize,
    /// Nodes of the mesh.
    pub(super) nodes: usize,
}

/// A reference solution cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ReferenceError {
    /// It has not been computed.
    #[error(
        "{path}: there is no such reference yet; compute it with `signorini reference` and the \
         same options"
    )]
    Missing {
        /// The file.
        path: PathBuf,
    },
    /// It belongs to another problem.
    #[error(
        "{path}: this reference belongs to another scene or mesh (hash {found:.12}, here \
         {expected:.12}); `signorini reference` with the same options computes it anew"
    )]
    Other {
        /// The file.
        path: PathBuf,
        /// Hash in the file.
        found: String,
        /// Hash of the scene and mesh at hand.
        expected: String,
    },
    /// The file is not what was written.
    #[error(
        "{path}: the file is damaged ({reason}); `signorini reference` with the same options \
         computes it anew"
    )]
    Damaged {
        /// The file.
        path: PathBuf,
        /// In what way.
        reason: String,
    },
    /// The file cannot be read.
    #[error("{path}: {source}")]
    Io {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
}

/// Bytes of a number.
const BYTES: usize = size_of::<f64>();

/// Writes the states whole or not at all.
///
/// Each is stored as its difference from the one before, bit by bit, byte k of all numbers
/// together: states that change little then begin with long runs of zeros.
pub(super) fn write(path: &Path, label: &Label, states: &[Fields]) -> Result<(), OutputError> {
    let failed = |e: std::io::Error| OutputError::new(path, e);
    let mut head = serde_json::to_vec(label).map_err(|e| OutputError::new(path, e))?;
    head.push(b'\n');
    let mut stream = ZlibEncoder::new(head, Compression::fast());
    let mut before = vec![0; 3 * label.nodes];
    for state in states {
        let bits: Vec<u64> = state.u.iter().chain(&state.zeta).map(|x| x.to_bits()).collect();
        let change: Vec<_> = bits.iter().zip(&before).map(|(a, b)| (a ^ b).to_le_bytes()).collect();
        for k in (0..BYTES).rev() {
            let plane: Vec<u8> = change.iter().map(|bytes| bytes[k]).collect();
            stream.write_all(&plane).map_err(failed)?;
        }
        before = bits;
    }
    write_whole(path, &stream.finish().map_err(failed)?)
}

/// Reads the states that [`write`] wrote under `label`.
pub(super) fn read(path: &Path, label: &Label) -> Result<Vec<Fields>, ReferenceError> {
    let path = path.to_owned();
    let file = match File::open(&path) {
        Ok(file) => file,
        Err(e) if e.kind() == ErrorKind::NotFound => return Err(ReferenceError::Missing { path }),
        Err(source) => return Err(ReferenceError::Io { path, source }),
    };
    let mut file = BufReader::new(file);
    let mut head = Vec::new();
    let damaged =
        |reason: &str| ReferenceError::Damaged { path: path.clone(), reason: reason.into() };
    // Not more than a label's length: another file may have no lines.
    let head_read = file.by_ref().take(1000).read_until(b'\n', &mut head);
    let found = head_read.ok().and_then(|_| serde_json::from_slice::<Label>(&head).ok());
    let found = found.ok_or_else(|| damaged("it does not begin with a label"))?;
    if found != *label {
        let expected = label.hash.clone();
        return Err(ReferenceError::Other { path, found: found.hash, expected });
    }

    let numbers = 3 * label.nodes;
    let mut bytes = Vec::with_capacity(label.states * numbers * BYTES);
    ZlibDecoder::new(file).read_to_end(&mut bytes).map_err(|e| damaged(&e.to_string()))?;
    if bytes.len() != label.states * numbers * BYTES {
        return Err(damaged("it ends too early"));
    }
    let mut before = vec![0_u64; numbers];
    let states = bytes.chunks_exact(numbers * BYTES).map(|state| {
        for (k, plane) in (0..BYTES).rev().zip(state.chunks_exact(numbers)) {
            for (bits, byte) in before.iter_mut().zip(plane) {
                *bits ^= u64::from(*byte) << (8 * k);
            }
        }
        let mut u: Vec<f64> = before.iter().map(|&bits| f64::from_bits(bits)).collect();
        let zeta = u.split_off(2 * label.nodes);
        Fields { u, zeta }
    });
    Ok(states.collect())
}
