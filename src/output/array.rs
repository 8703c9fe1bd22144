//! A VTK data array: binary, zlib-compressed, base64 (VTK file formats, "XML file formats").

use base64::{Engine, engine::general_purpose::STANDARD};
use flate2::{Compress, Compression, FlushCompress};
use std::fmt::Write;

/// Bytes that are compressed as one block.
const BLOCK: usize = 1 << 20;
/// zlib's fastest level: half the size for a tenth of the time of its best.
const LEVEL: u32 = 1;

/// Numbers that VTK has a name for.
pub(super) trait Number: Copy {
    /// VTK's name of the type.
    const TYPE: &'static str;
    /// The bytes, least significant first.
    fn bytes(self) -> impl AsRef<[u8]>;
}

macro_rules! number {
    ($type:ty, $name:literal) => {
        impl Number for $type {
            const TYPE: &'static str = $name;
            fn bytes(self) -> impl AsRef<[u8]> {
                self.to_le_bytes()
            }
        }
    };
}

number!(f64, "Float64");
number!(i32, "Int32");
number!(u8, "UInt8");

/// The element `<DataArray>` called `name` of values with `components` each.
pub(super) fn data_array<T: Number>(
    name: &str,
    components: usize,
    values: impl Iterator<Item = T>,
) -> std::io::Result<String> {
    let mut bytes = Vec::with_capacity(values.size_hint().0 * size_of::<T>());
    values.for_each(|value| bytes.extend_from_slice(value.bytes().as_ref()));
    let mut text = format!(
        "<DataArray type=\"{}\" Name=\"{name}\" NumberOfComponents=\"{components}\" \
         format=\"binary\">",
        T::TYPE
    );
    encode(&bytes, &mut text)?;
    text.push_str("</DataArray>\n");
    Ok(text)
}

/// Appends the header [blocks, bytes of a block, bytes of a last partial block, compressed bytes of
/// each] and the compressed blocks.
fn encode(bytes: &[u8], text: &mut String) -> std::io::Result<()> {
    let mut compressor = Compress::new(Compression::new(LEVEL), true);
    let mut header = vec![bytes.chunks(BLOCK).len(), BLOCK, bytes.len() % BLOCK];
    let mut compressed = Vec::with_capacity(bytes.len() / 2 + BLOCK);
    for block in bytes.chunks(BLOCK) {
        compressor.reset();
        let before = compressed.len();
        // zlib's bound on what it can grow to (zlib.h, compressBound).
        compressed.reserve(block.len() + block.len() / 1000 + 64);
        compressor.compress_vec(block, &mut compressed, FlushCompress::Finish)?;
        header.push(compressed.len() - before);
    }
    let header: Vec<u8> = header.iter().flat_map(|&n| (n as u64).to_le_bytes()).collect();
    STANDARD.encode_string(header, text);
    STANDARD.encode_string(compressed, text);
    Ok(())
}

/// The beginning of a VTK file of `kind`, whose arrays are made by [`data_array`].
pub(super) fn head(kind: &str) -> String {
    let mut text = String::from("<?xml version=\"1.0\"?>\n");
    let _ = writeln!(
        text,
        "<VTKFile type=\"{kind}\" version=\"1.0\" byte_order=\"LittleEndian\" \
         header_type=\"UInt64\" compressor=\"vtkZLibDataCompressor\">"
    );
    text
}
