//! Reading of model files and tables: valid inputs, and all messages about invalid ones.
#![allow(clippy::result_large_err, reason = "as in the library")]

mod constraint_messages;
mod input_errors;
mod instruments;
mod instruments_errors;
mod key_documentation;
mod key_limits;
mod model;
mod model_errors;
mod storage;
mod table;
mod table_errors;
mod units;
