//! Numbers at places in a slice, all of them checked: files say anything.

/// Is asked for memory, in bytes.
pub type Room<'a> = &'a mut dyn FnMut(u64) -> Result<(), String>;

/// Bytes of a grid's header, and where its tree follows.
pub const GRID_HEADER: u64 = 672;

/// So many bytes from `at` on.
pub fn slice(bytes: &[u8], at: u64, length: u64) -> Result<&[u8], String> {
    let end = at.checked_add(length);
    let range = end.and_then(|end| Some(usize::try_from(at).ok()?..usize::try_from(end).ok()?));
    let found = range.and_then(|range| bytes.get(range));
    found.ok_or_else(|| format!("it ends before byte {}", at.saturating_add(length)))
}

/// The bytes of a number.
pub fn array<const N: usize>(bytes: &[u8], at: u64) -> Result<[u8; N], String> {
    let mut array = [0; N];
    array.copy_from_slice(slice(bytes, at, N as u64)?);
    Ok(array)
}

/// Little endian, as all here.
pub fn u16_at(bytes: &[u8], at: u64) -> Result<u16, String> {
    array(bytes, at).map(u16::from_le_bytes)
}

pub fn u32_at(bytes: &[u8], at: u64) -> Result<u32, String> {
    array(bytes, at).map(u32::from_le_bytes)
}

pub fn u64_at(bytes: &[u8], at: u64) -> Result<u64, String> {
    array(bytes, at).map(u64::from_le_bytes)
}

pub fn i32_at(bytes: &[u8], at: u64) -> Result<i32, String> {
    array(bytes, at).map(i32::from_le_bytes)
}

pub fn f32_at(bytes: &[u8], at: u64) -> Result<f32, String> {
    array(bytes, at).map(f32::from_le_bytes)
}

/// A row of numbers.
pub fn f64s_at<const N: usize>(bytes: &[u8], at: u64) -> Result<[f64; N], String> {
    let mut row = [0.0; N];
    for (i, value) in row.iter_mut().enumerate() {
        *value = array(bytes, at.saturating_add(8 * i as u64)).map(f64::from_le_bytes)?;
    }
    Ok(row)
}

/// What starts at an offset from a place, which may lie before it.
pub fn beside(at: u64, offset: i64) -> Result<u64, String> {
    let sum = at.checked_add_signed(offset);
    sum.ok_or_else(|| "a node lies outside of the grid".to_owned())
}
