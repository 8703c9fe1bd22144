//! Whole files: text in UTF-8, and files that appear complete or not at all.

use std::{
    fs::{self, File, Permissions},
    io::{self, Write},
    os::unix::fs::PermissionsExt,
    path::Path,
};

/// The bytes of a file. A pipe or a device might never end; standard input is read.
pub(crate) fn read(path: &Path) -> io::Result<Vec<u8>> {
    let there = fs::metadata(path)?;
    let is_input = ["/dev/stdin", "/dev/fd"].iter().any(|input| path.starts_with(input));
    match there.is_file() || there.is_dir() || is_input {
        true => fs::read(path),
        false => Err(io::Error::other("it is a pipe or a device; name a file")),
    }
}

/// The text of a file.
///
/// # Errors
/// The file is not in UTF-8.
pub(crate) fn text(bytes: Vec<u8>) -> Result<String, String> {
    // No text in UTF-8 has a zero; every text in UTF-16 with Latin letters has one.
    if bytes.contains(&0) {
        return Err("is in UTF-16 or no text; save the file in UTF-8".to_owned());
    }
    String::from_utf8(bytes).map_err(|error| {
        let before = &error.as_bytes()[..error.utf8_error().valid_up_to()];
        let line = before.iter().filter(|&&byte| byte == b'\n').count() + 1;
        format!("line {line} is not in UTF-8; save the file in this encoding")
    })
}

/// The names of incomplete files begin with this.
pub(crate) const PARTIAL: &str = ".signorini-partial-";

/// The rule of all writers: a file may stand where nothing is, or where a file is that this program has written. It writes no
/// links.
pub(crate) fn is_free(path: &Path, is_own: impl FnOnce() -> bool) -> bool {
    fs::symlink_metadata(path).map_or(true, |there| there.is_file() && is_own())
}

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
