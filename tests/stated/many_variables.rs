//! The work of `init` on a file of MATLAB with thousands of small variables beside a record grows in proportion to their number.

use kmcfit::config::{Source, Statements, scaffold};
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

/// Counts the allocations of a thread, a measure of work that does not depend on the machine.
struct Counting;

thread_local!(static COUNT: Cell<u64> = const { Cell::new(0) });

#[global_allocator]
static ALLOCATOR: Counting = Counting;

// SAFETY: all requests are passed to the allocator of the system.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // A thread that ends has no count.
        let _ = COUNT.try_with(|count| count.set(count.get() + 1));
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        unsafe { System.dealloc(at, layout) }
    }
}

/// An element of a file of MATLAB 5.
fn element(kind: u32, content: &[u8]) -> Vec<u8> {
    let mut bytes = [kind, content.len() as u32].map(u32::to_le_bytes).concat();
    bytes.extend(content);
    bytes.resize(bytes.len().next_multiple_of(8), 0);
    bytes
}

/// A matrix of a class with its name and content.
fn matrix(class: u32, rows: usize, name: &str, content: &[u8]) -> Vec<u8> {
    let flags = element(6, &[class, 0].map(u32::to_le_bytes).concat());
    let size = element(5, &[rows as u32, 1].map(u32::to_le_bytes).concat());
    element(
        14,
        &[&flags, &size, &*element(1, name.as_bytes()), content].concat(),
    )
}

/// A struct with a record and `count` numbers beside it.
fn file(count: usize) -> Vec<u8> {
    let number = |values: &[f64]| {
        let bytes: Vec<u8> = values.iter().flat_map(|x| x.to_le_bytes()).collect();
        matrix(6, values.len(), "", &element(9, &bytes))
    };
    let record: Vec<f64> = (0..300).map(|i| 0.02 * f64::from(i)).collect();
    let response: Vec<f64> = record.iter().map(|t| (12.0 * t).cos()).collect();
    let mut names = b"t\0\0\0\0\0\0\0acc\0\0\0\0\0".to_vec();
    let mut fields = [number(&record), number(&response)].concat();
    for i in 0..count {
        names.extend(format!("p{i:06}\0").bytes());
        fields.extend(number(&vec![1.0; 1 + i % 7]));
    }
    let head = [element(5, &8u32.to_le_bytes()), element(1, &names)].concat();
    let mut bytes = format!("{:<124}", "MATLAB 5.0 MAT-file").into_bytes();
    bytes.extend(b"\x00\x01IM");
    bytes.extend(matrix(2, 1, "s", &[head, fields].concat()));
    bytes
}

#[test]
fn work_grows_in_proportion() {
    let work = |count: usize| {
        let source = Source::in_memory("many.mat", file(count));
        let before = COUNT.with(Cell::get);
        let found = scaffold(&[source], &Statements::default()).expect("a model");
        assert!(found.text.contains("acceleration: s.acc"), "{}", found.text);
        COUNT.with(Cell::get) - before
    };
    let [few, many] = [1_150, 4_600].map(work);
    assert!(many < 6 * few, "{few} and {many} allocations");
    assert!(many < 200 * 4_600, "{many} allocations");
}
