//! Files of MATLAB, version 4: a header of five integers, a name and the numbers of each matrix.
//!
//! Reference: MathWorks, "MAT-File Format", chapter 2.

use std::path::Path;

use super::array::Array;
use super::budget::Budget;
use super::bytes::Bytes;
use super::number::{ByteOrder, NumberType};
use super::{Channels, mat_class};
use crate::error::InputError;
use crate::text_io::quote;

/// Byte order and type of numbers of the first header, if it is one: the type is 1000 M + 10 P + T with M the
/// byte order, P the precision and T the kind of matrix.
fn header(bytes: &[u8]) -> Option<ByteOrder> {
    let first: [u8; 4] = bytes.get(..4)?.try_into().ok()?;
    let is_type =
        |code: u32, order: u32| code / 1000 == order && code % 1000 / 10 <= 5 && code % 10 <= 2;
    if is_type(u32::from_le_bytes(first), 0) {
        return Some(ByteOrder::Little);
    }
    is_type(u32::from_be_bytes(first), 1).then_some(ByteOrder::Big)
}

/// True for bytes that begin like a file of version 4, which has no magic.
pub(super) fn begins_so(bytes: &[u8]) -> bool {
    header(bytes).is_some()
}

pub(super) fn read(path: &Path, bytes: &[u8], budget: &mut Budget) -> Result<Channels, InputError> {
    let order = header(bytes).unwrap_or(ByteOrder::Little);
    let mut file = Bytes::new(path, bytes, order);
    let mut channels = Channels::default();
    while !file.is_empty() {
        matrix(&mut file, &mut channels, budget)?;
    }
    Ok(channels)
}

fn matrix(
    file: &mut Bytes,
    channels: &mut Channels,
    budget: &mut Budget,
) -> Result<(), InputError> {
    let what = "the header of a variable";
    let code = file.u32(what)?;
    let [rows, columns, imaginary, length] = [
        file.u32(what)?,
        file.u32(what)?,
        file.u32(what)?,
        file.u32(what)?,
    ];
    let name = file.take(u64::from(length), what)?;
    let name = String::from_utf8_lossy(name)
        .trim_end_matches('\0')
        .to_owned();
    budget.name(&name)?;
    let what = format!("the variable {}", quote(&name));
    let kind = match code % 1000 / 10 {
        0 => NumberType::F64,
        1 => NumberType::F32,
        2 => NumberType::I32,
        3 => NumberType::I16,
        4 => NumberType::U16,
        5 => NumberType::U8,
        _ => {
            let error = budget.damaged(&what);
            return Err(error.found(format!("the type {code}")));
        }
    };
    let size = (u64::from(rows) * u64::from(columns)).saturating_mul(kind.size() as u64);
    let data = file.take(size, &what)?;
    if imaginary != 0 {
        file.take(size, &what)?;
        channels.refuse(
            &name,
            "complex numbers",
            Some("save the real samples in time"),
        );
        return Ok(());
    }
    match code % 10 {
        0 => Array {
            bytes: data,
            kind,
            order: file.order,
            rows: rows as usize,
            columns: columns as usize,
            column_major: true,
        }
        .add_to(channels, &name, None, budget),
        kind => {
            let (content, hint) = mat_class::old(if kind == 1 { 4 } else { 5 });
            channels.refuse(&name, content, hint);
            Ok(())
        }
    }
}
