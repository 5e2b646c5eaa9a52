//! Results on disk: folders that appear whole or not at all, and files of rows that grow.

mod files;
mod output_folder;
mod row_file;

pub use files::{write_together, write_whole};
pub use output_folder::{OutputFolder, RESULT, read_lock};
pub use row_file::{RowFile, complete_lines};
