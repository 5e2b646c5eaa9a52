//! Types of numbers in binary files, and their conversion to double precision.

/// Order of the bytes of a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ByteOrder {
    Little,
    Big,
}

/// Type of a number. Integers beyond 2^53 are rounded to double precision.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum NumberType {
    I8,
    I16,
    I24,
    I32,
    I64,
    U8,
    U16,
    U32,
    U64,
    F16,
    F32,
    F64,
}

impl NumberType {
    /// Number of bytes.
    pub fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 | Self::F16 => 2,
            Self::I24 => 3,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    /// The number in the first [`size`](Self::size) of `bytes`; missing bytes are zero.
    pub fn value(self, bytes: &[u8], order: ByteOrder) -> f64 {
        match self {
            Self::I8 => f64::from(i8::from_le_bytes(array(bytes, order))),
            Self::U8 => f64::from(u8::from_le_bytes(array(bytes, order))),
            Self::I16 => f64::from(i16::from_le_bytes(array(bytes, order))),
            Self::U16 => f64::from(u16::from_le_bytes(array(bytes, order))),
            Self::I24 => {
                let [a, b, c] = array(bytes, order);
                // The sign stands in the highest byte; the division is exact.
                f64::from(i32::from_le_bytes([0, a, b, c])) / 256.0
            }
            Self::I32 => f64::from(i32::from_le_bytes(array(bytes, order))),
            Self::U32 => f64::from(u32::from_le_bytes(array(bytes, order))),
            Self::I64 => i64::from_le_bytes(array(bytes, order)) as f64,
            Self::U64 => u64::from_le_bytes(array(bytes, order)) as f64,
            Self::F16 => half(u16::from_le_bytes(array(bytes, order))),
            Self::F32 => f64::from(f32::from_le_bytes(array(bytes, order))),
            Self::F64 => f64::from_le_bytes(array(bytes, order)),
        }
    }

    /// Number i of adjacent ones.
    pub fn value_at(self, bytes: &[u8], order: ByteOrder, i: usize) -> f64 {
        let own = bytes.get(i.saturating_mul(self.size())..);
        self.value(own.unwrap_or_default(), order)
    }

    /// The numbers of whole records of `stride` bytes, each at `offset` in its record.
    pub fn values(
        self,
        bytes: &[u8],
        order: ByteOrder,
        offset: usize,
        stride: usize,
    ) -> impl Iterator<Item = f64> + '_ {
        let end = offset.saturating_add(self.size());
        let records = bytes.chunks_exact(stride.max(1));
        records.filter_map(move |record| Some(self.value(record.get(offset..end)?, order)))
    }
}

/// The first N bytes, lowest first.
fn array<const N: usize>(bytes: &[u8], order: ByteOrder) -> [u8; N] {
    let mut found = [0; N];
    for (to, from) in found.iter_mut().zip(bytes) {
        *to = *from;
    }
    if order == ByteOrder::Big {
        found.reverse();
    }
    found
}

/// A number of half precision (IEEE 754 binary16).
fn half(bits: u16) -> f64 {
    let exponent = i32::from((bits >> 10) & 0x1f);
    let fraction = f64::from(bits & 0x3ff);
    let magnitude = match exponent {
        0 => fraction * 2f64.powi(-24),
        0x1f if fraction == 0.0 => f64::INFINITY,
        0x1f => f64::NAN,
        _ => (1024.0 + fraction) * 2f64.powi(exponent - 25),
    };
    match bits >> 15 {
        0 => magnitude,
        _ => -magnitude,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_all_types() {
        use ByteOrder::{Big, Little};
        for (kind, little, value) in [
            (NumberType::I8, &[0x80][..], -128.0),
            (NumberType::U8, &[0x80], 128.0),
            (NumberType::I16, &[0, 0x80], -32768.0),
            (NumberType::U16, &[0, 0x80], 32768.0),
            (NumberType::I24, &[0xff, 0xff, 0xff], -1.0),
            (NumberType::I24, &[0xff, 0xff, 0x7f], 8_388_607.0),
            (NumberType::I32, &[0, 0, 0, 0x80], -2_147_483_648.0),
            (NumberType::U32, &[0, 0, 0, 0x80], 2_147_483_648.0),
            (
                NumberType::I64,
                &[0xfe, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff],
                -2.0,
            ),
            (
                NumberType::U64,
                &[0, 0, 0, 0, 0, 0, 0, 0x80],
                9_223_372_036_854_775_808.0,
            ),
            // Values of the standard: one, the least normal and subnormal numbers, and the largest.
            (NumberType::F16, &[0x00, 0x3c], 1.0),
            (NumberType::F16, &[0x00, 0x04], 6.103_515_625e-5),
            (NumberType::F16, &[0x01, 0x00], 5.960_464_477_539_063e-8),
            (NumberType::F16, &[0xff, 0xfb], -65504.0),
            (NumberType::F16, &[0x00, 0x7c], f64::INFINITY),
            (NumberType::F32, &[0, 0, 0x20, 0xc0], -2.5),
            (NumberType::F64, &[0, 0, 0, 0, 0, 0, 0x04, 0x40], 2.5),
        ] {
            assert_eq!(kind.size(), little.len());
            assert_eq!(kind.value(little, Little), value, "{kind:?}");
            let big: Vec<u8> = little.iter().rev().copied().collect();
            assert_eq!(kind.value(&big, Big), value, "{kind:?}");
        }
        assert!(NumberType::F16.value(&[0x01, 0x7c], Little).is_nan());
    }
}
