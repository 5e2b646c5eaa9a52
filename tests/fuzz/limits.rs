//! What is too large or no file at all is refused at once, with the limit.
