use super::*;

/// The operations of the lanes that all arithmetics do alike, as bits.
struct Everything {
    a: [Row; LANES],
    b: Row,
}

impl Kernel for Everything {
    type Output = Vec<u64>;

    #[inline(always)]
    fn run<A: Arithmetic>(self, arithmetic: A) -> Vec<u64> {
        let mut rows = transposed(arithmetic, &self.a).to_vec();
        let b = Eight::load(arithmetic, &self.b);
        for row in self.a {
            let a = Eight::load(arithmetic, &row);
            rows.push((a + b).row());
            rows.push((a - b).row());
            rows.push((a * b).row());
            rows.push((a / b).row());
            rows.push((a * b + a * a - b / a).row());
            rows.push((-a).row());
        }
        rows.as_flattened().iter().map(|x| x.to_bits()).collect()
    }
}

#[test]
fn all_arithmetics_give_the_same_bits() {
    let number = |i: usize| (i as f64 * 0.7 + 0.1).sin() * 10f64.powi(i as i32 % 9 - 4);
    let a: [Row; LANES] = std::array::from_fn(|i| std::array::from_fn(|j| number(8 * i + j)));
    let b: Row = std::array::from_fn(|j| number(100 + j));
    let outputs = on_each(|| Everything { a, b });
    for (i, row) in a.iter().enumerate() {
        for (j, x) in row.iter().enumerate() {
            assert_eq!(outputs[0][j * LANES + i], x.to_bits(), "transposed {i} {j}");
        }
    }
    for output in &outputs[1..] {
        assert_eq!(output, &outputs[0]);
    }
}

/// Quotients of the rows by the last one, as a division gives them and as [`Eight::quotients`] does.
struct Quotients {
    a: Row,
    b: Row,
    d: Row,
}

impl Kernel for Quotients {
    type Output = [[Row; 2]; 2];

    #[inline(always)]
    fn run<A: Arithmetic>(self, arithmetic: A) -> [[Row; 2]; 2] {
        let [a, b, d] = [self.a, self.b, self.d].map(|row| Eight::load(arithmetic, &row));
        let both = Eight::quotients(a, b, d);
        [[a / d, b / d], both].map(|pair| pair.map(Eight::row))
    }
}

/// A numerator and a divisor whose quotient is as near to half-way between two numbers as one of numbers with 53 bits can
/// be: with `middle = ±1/divisor mod 2^54`, `numerator 2^54 - divisor middle = ∓1`.
pub(crate) fn hardest(random: &mut impl FnMut() -> u64) -> [f64; 2] {
    const MODULUS: u128 = 1 << 54;
    loop {
        let divisor = u128::from(random() >> 11 | 1 << 52 | 1);
        // Newton's iteration doubles the bits of the inverse that are right, three at first.
        let inverse = (0..5).fold(divisor, |x, _| {
            x * (2 + MODULUS - divisor * x % MODULUS) % MODULUS
        });
        let is_above = random().is_multiple_of(2);
        let middle = if is_above { MODULUS - inverse } else { inverse };
        let product = divisor * middle;
        let numerator = (product + u128::from(is_above)) / MODULUS;
        assert_eq!(
            numerator * MODULUS,
            if is_above { product + 1 } else { product - 1 }
        );
        if middle >= MODULUS / 2 {
            return [numerator as f64, divisor as f64];
        }
    }
}

#[test]
fn quotients_have_the_bits_of_divisions_but_next_to_a_middle() {
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let mut random = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        state
    };
    for round in 0..20_000 {
        let pairs: [[f64; 2]; LANES] = std::array::from_fn(|_| hardest(&mut random));
        let size = 2f64.powi([0, 0, 0, 240, -340][round % 5]);
        let [a, d] = [0, 1].map(|which| pairs.map(|pair| pair[which] * size));
        let mut any = || (random() >> 11) as f64 * 2f64.powi([0, 540, -640][round % 3]);
        let b: Row = std::array::from_fn(|_| if round % 16 == 0 { 0.0 } else { -any() });
        for [divided, quotients] in on_each(|| Quotients { a, b, d }) {
            let bits = |row: Row| row.map(|x| (x + 0.0).to_bits());
            let mut both = bits(divided[0]).into_iter().zip(bits(quotients[0]));
            assert!(both.all(|(a, b)| a.abs_diff(b) <= 1), "{a:?} {d:?}");
            assert_eq!(bits(quotients[1]), bits(divided[1]), "{b:?} {d:?}");
        }
    }
}
