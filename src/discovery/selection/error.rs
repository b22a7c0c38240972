//! Why a search for effects has no outcome.

/// The model becomes infinite along the data, so that nothing can be fitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Diverged {
    /// Before any effect is added.
    #[error("the model without effects diverges on the data; check its parameters and units")]
    Bare,
    /// With effects.
    #[error("the model diverges on the data; check its parameters and units")]
    WithEffects,
}
