//! The filter as a whole.
