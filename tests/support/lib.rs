//! What the whole-system tests share: scenes built in code, pictures of them, and how pictures are judged.

pub mod blocks;
pub mod build;
pub mod files;
pub mod picture;
pub mod solved;
pub mod stability;
pub mod stuff;
