//! How finely a picture is drawn.

/// How a picture is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Options {
    /// Looks per pixel where surfaces meet; 1 draws without a second pass.
    pub edge_samples: u16,
    /// Whether things cast shadows.
    pub shadows: bool,
    /// Edge of a cell of the grid in which shadows on the table are worked out, mm.
    pub shadow_cell_mm: u16,
}

impl Default for Options {
    fn default() -> Self {
        // Shadows of a wide lamp are softer than six millimetres.
        Self { edge_samples: 16, shadows: true, shadow_cell_mm: 6 }
    }
}

impl Options {
    /// Returns the quickest drawing: ragged edges, no shadows.
    pub fn quick() -> Self {
        // Without shadows the table's light changes slowly from place to place.
        Self { edge_samples: 1, shadows: false, shadow_cell_mm: 48 }
    }

    /// Returns the drawing of small pictures of a film: a pixel is as wide as half a cell of its shadows.
    pub fn film() -> Self {
        Self { edge_samples: 2, shadows: true, shadow_cell_mm: 18 }
    }
}
