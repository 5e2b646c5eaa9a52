//! Tables of samples: reading of text files and of the channels of binary files as data loggers write them, checks of their
//! times, and resampling.

mod channels;
mod columns;
mod detect;
mod encoding;
mod field;
mod fill;
mod format;
mod missing_codes;
mod origin;
mod preamble;
mod repeats;
mod rows;
mod stated;
mod table;
mod table_memory;
mod text_columns;
pub mod times;

pub use columns::ColumnName;
pub use encoding::Encoding;
pub use format::{Detected, TableFormat};
pub use missing_codes::{codes, codes_of_column};
pub use repeats::{Duplicates, RepeatedTimes, lines_in_words, repeated_times};
pub use stated::StatedUnit;
pub(crate) use table::TABLE;
pub use table::Table;
pub use times::{SAMPLE_RATES, increasing, increasing_at, sample_rates, without_rounding};
