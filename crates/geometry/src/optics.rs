//! Reflect, refract, Fresnel: both passes send rays on through glass.
