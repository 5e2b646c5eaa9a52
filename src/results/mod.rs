//! Results on disk: folders that appear whole or not at all, and files of rows that grow.

mod exchange;
mod files;
mod output_folder;
mod row_file;

pub use exchange::read_lock;
pub use files::{write_together, write_whole};
pub use output_folder::{OutputFolder, RESULT, owner};
pub use row_file::{RowFile, complete_lines};
