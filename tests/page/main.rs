//! The pages that runs, comparisons and studies leave behind: what is in them, and how they work in a
//! real browser.

mod browser;
mod charts;
mod contrast;
mod pages;
mod structure;
