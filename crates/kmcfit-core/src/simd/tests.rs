use super::*;

/// All operations of the arithmetics, as bits.
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
