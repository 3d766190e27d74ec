//! Whole-system tests; each module asks one kind of question.

mod agreement;
mod analytic;
mod property;
mod random_rooms;
mod stability;
mod statistical;
