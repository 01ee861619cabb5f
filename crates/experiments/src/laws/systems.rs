//! Which systems have a law of harmonics, powers and friction, and of how many terms.

/// The number of terms of the law of each system, written in its coordinates with as few harmonics and powers as it can be, friction
/// among them. Of those that this table does not name the law is no finite sum of these.
const TERMS: &[(&str, usize)] = &[
    ("mass-spring", 2),
    ("pendulum", 2),
    ("double-pendulum", 5),
    ("n-link-pendulum", 9),
    ("cart-pole", 4),
    ("furuta-pendulum", 5),
    ("two-link-arm", 7),
    ("charged-particle", 3),
    ("duffing", 3),
    ("double-well", 3),
    ("inertia-by-place", 3),
    ("henon-heiles", 6),
    ("quartic-pair", 5),
    ("three-springs", 8),
    ("elastic-pendulum", 5),
    ("spherical-pendulum", 4),
    ("double-relative", 7),
    ("coupled-pendulums", 5),
    ("wheel-pendulum", 4),
    ("acrobot-spring", 8),
    ("scotch-yoke", 3),
    ("bead-parabola", 3),
    ("turning-hoop", 3),
    ("bowl", 7),
    ("torus", 5),
    ("cart-two-links", 9),
    ("cart-spring", 5),
    ("crane", 9),
    ("rotating-frame", 8),
    ("charged-quartic", 7),
    ("top", 6),
    ("rolling-eccentric", 3),
    ("hoop-pendulum", 5),
    ("atwood-swinging", 5),
    ("central-quartic", 3),
    ("lift-arm", 9),
    ("pendulum, viscous", 3),
    ("double-relative, viscous", 9),
    ("duffing, drag", 4),
    ("elastic-pendulum, viscous", 7),
    ("cart-spring, viscous", 7),
    ("bead-parabola, drag", 4),
    ("torus, viscous", 7),
    ("two-link-arm, viscous", 9),
];

/// The number of terms of the law of a system; none where it has no such law.
pub(super) fn terms(system: &str) -> Option<usize> {
    let own = TERMS.iter().find(|own| own.0 == system);
    own.map(|own| own.1)
}

/// Whether the coordinates of a system are those of points of a plane, which nothing joins.
pub(super) const FREE_POINTS: &[&str] = &[
    "henon-heiles",
    "quartic-pair",
    "elastic-plane",
    "bowl",
    "rotating-frame",
    "two-centres",
    "charged-quartic",
    "charged-uneven",
    "charged-particle",
    "kepler",
    "n-body",
];

/// The systems that have such a law.
#[cfg(test)]
pub(super) fn named() -> impl Iterator<Item = &'static str> {
    TERMS.iter().map(|own| own.0)
}
