//! Whole-system tests; each module asks one kind of question.
