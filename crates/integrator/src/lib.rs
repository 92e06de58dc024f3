//! A thin CPU reference integrator, film and image metrics.
