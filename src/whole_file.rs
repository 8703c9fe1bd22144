//! Files that appear complete or not at all.

use std::{
    fs::{File, Permissions},
    io::{self, Write},
    os::unix::fs::PermissionsExt,
    path::Path,
};

/// The names of incomplete files begin with this.
pub(crate) const PARTIAL: &str = ".partial-";

/// Writes a file with the usual permissions: a complete temporary file beside it is renamed. `complete` may do more with
/// it before.
pub(crate) fn write(
    path: &Path,
    content: &[u8],
    complete: impl FnOnce(&File) -> io::Result<()>,
) -> io::Result<()> {
    let mut file = tempfile::Builder::new()
        .prefix(PARTIAL)
        .permissions(Permissions::from_mode(0o666))
        .tempfile_in(path.with_file_name("."))?;
    file.write_all(content)?;
    complete(file.as_file())?;
    Ok(file.persist(path).map(drop)?)
}
