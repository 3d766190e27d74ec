//! The shading model: eval, sample and pdf of each lobe.
