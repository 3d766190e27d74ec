//! What pencil and paper give, within the method's stated error.

mod enclosures;
mod measure;
mod optics;
mod photometric;
mod reference_data;
mod shadows;
