//! Pages of runs, comparisons and studies: their contents, and their function in a browser.

mod browser;
mod charts;
mod contrast;
mod pages;
mod screen;
mod structure;
