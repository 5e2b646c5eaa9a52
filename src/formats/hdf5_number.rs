//! Numbers of HDF5: integers and floating-point numbers of any length, place and bias within up to 8 bytes.

use hdf5_pure::{Datatype, DatatypeByteOrder, FixedPointLayout, FloatingPointLayout};

/// Form of a number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Number {
    pub size: usize,
    is_big: bool,
    layout: Layout,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Layout {
    Integer(FixedPointLayout),
    Floating(FloatingPointLayout),
}

impl Number {
    /// The form of a type; `None` for one that is no number, or of a form that is not known.
    pub fn of(kind: &Datatype) -> Option<Self> {
        let (size, order, layout) = match kind {
            Datatype::Enumeration { base_type, .. }
                if matches!(**base_type, Datatype::FixedPoint { .. }) =>
            {
                return Self::of(base_type);
            }
            Datatype::FixedPoint {
                size,
                byte_order,
                layout,
            } => (*size, byte_order, Layout::Integer(*layout)),
            Datatype::FloatingPoint {
                size,
                byte_order,
                layout,
            } => (*size, byte_order, Layout::Floating(*layout)),
            _ => return None,
        };
        let (begin, bits) = match layout {
            Layout::Integer(l) => (l.bit_offset, l.bit_precision),
            Layout::Floating(l) => {
                let fits = |at: u8, size: u8| u16::from(at) + u16::from(size) <= 64;
                let is_known = (1..=11).contains(&l.exponent_size)
                    && l.mantissa_size <= 52
                    && fits(l.exponent_location, l.exponent_size)
                    && fits(l.mantissa_location, l.mantissa_size)
                    && l.exponent_bias < 1 << l.exponent_size;
                (is_known.then_some(l.bit_offset)?, l.bit_precision)
            }
        };
        let is_big = match order {
            DatatypeByteOrder::LittleEndian => false,
            DatatypeByteOrder::BigEndian => true,
            DatatypeByteOrder::Vax => return None,
        };
        let is_inside = bits > 0 && u32::from(begin) + u32::from(bits) <= 8 * size.min(8);
        (size <= 8 && is_inside).then_some(Self {
            size: size as usize,
            is_big,
            layout,
        })
    }

    /// The number in the first bytes; missing ones are zero.
    pub fn value(&self, bytes: &[u8]) -> f64 {
        let mut own = [0; 8];
        for (to, from) in own.iter_mut().zip(bytes.iter().take(self.size)) {
            *to = *from;
        }
        let word = match self.is_big {
            true => u64::from_be_bytes(own) >> (64 - 8 * self.size),
            false => u64::from_le_bytes(own),
        };
        match self.layout {
            Layout::Integer(layout) => {
                let unused = 64 - u32::from(layout.bit_precision);
                let word = (word >> layout.bit_offset) << unused;
                match layout.signed {
                    true => (word as i64 >> unused) as f64,
                    false => (word >> unused) as f64,
                }
            }
            Layout::Floating(FloatingPointLayout::IEEE754_BINARY64) => f64::from_bits(word),
            Layout::Floating(FloatingPointLayout::IEEE754_BINARY32) => {
                f64::from(f32::from_bits(word as u32))
            }
            Layout::Floating(layout) => floating(word, layout),
        }
    }
}

/// A floating-point number whose first bit of the mantissa is implied and whose sign is its last bit.
fn floating(word: u64, layout: FloatingPointLayout) -> f64 {
    let part = |at: u8, size: u8| (word >> at) & ((1 << size) - 1);
    let exponent = part(layout.exponent_location, layout.exponent_size);
    let mantissa = part(layout.mantissa_location, layout.mantissa_size);
    let fraction = mantissa as f64 / (1u64 << layout.mantissa_size) as f64;
    let bias = layout.exponent_bias as i32;
    let magnitude = match exponent {
        0 => fraction * 2f64.powi(1 - bias),
        e if e == (1 << layout.exponent_size) - 1 && mantissa == 0 => f64::INFINITY,
        e if e == (1 << layout.exponent_size) - 1 => f64::NAN,
        e => (1.0 + fraction) * 2f64.powi(e as i32 - bias),
    };
    match (word >> (layout.bit_offset + layout.bit_precision - 1)) & 1 {
        0 => magnitude,
        _ => -magnitude,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn number(size: u32, byte_order: DatatypeByteOrder, layout: Layout) -> Option<Number> {
        Number::of(&match layout {
            Layout::Integer(layout) => Datatype::FixedPoint {
                size,
                byte_order,
                layout,
            },
            Layout::Floating(layout) => Datatype::FloatingPoint {
                size,
                byte_order,
                layout,
            },
        })
    }

    fn integer(size: u32, signed: bool, bit_offset: u16, bit_precision: u16) -> Option<Number> {
        let layout = FixedPointLayout {
            signed,
            bit_offset,
            bit_precision,
        };
        number(
            size,
            DatatypeByteOrder::LittleEndian,
            Layout::Integer(layout),
        )
    }

    #[test]
    fn words_of_converters() {
        for (form, bytes, value) in [
            (integer(2, true, 0, 12), &[0xff, 0x0f][..], -1.0),
            (integer(2, false, 4, 12), &[0xf5, 0xff], 4095.0),
            (integer(4, true, 8, 24), &[0x55, 0, 0, 0x80], -8_388_608.0),
            (integer(3, true, 0, 24), &[0xfe, 0xff, 0xff], -2.0),
            (
                integer(8, false, 0, 64),
                &[0, 0, 0, 0, 0, 0, 0, 0x80],
                2f64.powi(63),
            ),
        ] {
            assert_eq!(form.map(|form| form.value(bytes)), Some(value), "{bytes:?}");
        }
        // Bits beyond the word.
        assert_eq!(integer(2, true, 8, 12), None);
        assert_eq!(integer(9, true, 0, 64), None);
    }

    #[test]
    fn floating_point_numbers() {
        use DatatypeByteOrder::{BigEndian, LittleEndian, Vax};
        let half = FloatingPointLayout {
            bit_offset: 0,
            bit_precision: 16,
            exponent_location: 10,
            exponent_size: 5,
            mantissa_location: 0,
            mantissa_size: 10,
            exponent_bias: 15,
        };
        let form = number(2, LittleEndian, Layout::Floating(half)).expect("a number");
        // Values of IEEE 754: one, the least subnormal number, the largest, infinity.
        for (bytes, value) in [
            ([0x00, 0x3c], 1.0),
            ([0x01, 0x00], 5.960_464_477_539_063e-8),
            ([0xff, 0xfb], -65504.0),
            ([0x00, 0x7c], f64::INFINITY),
        ] {
            assert_eq!(form.value(&bytes), value, "{bytes:?}");
        }
        assert!(form.value(&[0x01, 0x7c]).is_nan());
        let single = FloatingPointLayout::IEEE754_BINARY32;
        let form = number(4, BigEndian, Layout::Floating(single)).expect("a number");
        assert_eq!(form.value(&[0xc0, 0x20, 0, 0]), -2.5);
        let biased = FloatingPointLayout {
            exponent_bias: 120,
            ..single
        };
        let form = number(4, BigEndian, Layout::Floating(biased)).expect("a number");
        assert_eq!(form.value(&[0xc0, 0x20, 0, 0]), -320.0);
        assert_eq!(number(4, Vax, Layout::Floating(single)), None);
    }
}
