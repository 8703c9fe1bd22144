//! The state of a run as bytes, from which it goes on bit by bit as if it had not ended.
//!
//! Whoever has state that later bits depend on lists it once, in a function that saves and loads alike:
//! each value is written to the archive, or replaced by what was written in its place.

use serde::{Serialize, de::DeserializeOwned};
use std::mem::take;

/// The state of a run while it is saved or loaded.
#[derive(Debug)]
pub struct Archive {
    bytes: Vec<u8>,
    /// How much of it has been loaded; `None` while saving.
    loaded: Option<usize>,
}

/// The bytes are not those of such a value.
#[derive(Debug, Clone, thiserror::Error)]
#[error("the state of the run cannot be read: {0}")]
pub struct ArchiveError(#[from] postcard::Error);

impl Archive {
    /// An archive to save in.
    pub fn saving() -> Self {
        Self { bytes: Vec::new(), loaded: None }
    }

    /// An archive to load from.
    pub fn loading(bytes: Vec<u8>) -> Self {
        Self { bytes, loaded: Some(0) }
    }

    /// Whether values are loaded.
    pub fn is_loading(&self) -> bool {
        self.loaded.is_some()
    }

    /// Saves a value, or replaces it by what was saved in its place.
    ///
    /// # Errors
    /// The bytes are not those of such a value.
    pub fn value<T: Serialize + DeserializeOwned>(
        &mut self,
        value: &mut T,
    ) -> Result<(), ArchiveError> {
        match &mut self.loaded {
            None => self.bytes = postcard::to_extend(value, take(&mut self.bytes))?,
            Some(loaded) => {
                let (read, rest) = postcard::take_from_bytes(&self.bytes[*loaded..])?;
                (*value, *loaded) = (read, self.bytes.len() - rest.len());
            }
        }
        Ok(())
    }

    /// What was saved.
    pub fn into_bytes(self) -> Vec<u8> {
        self.bytes
    }
}
