//! The wish to stop. Who obeys it, and how an arm is brought to rest, is the devices' matter.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// A wish to stop, shared by the prompt, the scripts and the arm. Cloning shares it.
#[derive(Debug, Clone, Default)]
pub struct Cancel {
    own: Arc<AtomicBool>,
    /// The wish that this one also obeys.
    above: Option<Arc<Cancel>>,
}

impl Cancel {
    /// Asks everyone who polls to stop.
    pub fn cancel(&self) {
        self.own.store(true, Ordering::SeqCst);
    }

    /// Forgets the wish, before the next command.
    pub fn clear(&self) {
        self.own.store(false, Ordering::SeqCst);
    }

    /// Returns whether someone asked to stop.
    pub fn is_cancelled(&self) -> bool {
        self.own.load(Ordering::SeqCst)
            || self.above.as_ref().is_some_and(|above| above.is_cancelled())
    }

    /// Returns whether everything is to stop, and not only what a child of the wish was made for.
    pub fn is_for_all(&self) -> bool {
        self.above.as_ref().map_or_else(|| self.is_cancelled(), |above| above.is_for_all())
    }

    /// Returns a wish of its own that also obeys this one: what stops one motion and nothing else.
    #[must_use]
    pub fn child(&self) -> Self {
        Self { own: Arc::default(), above: Some(Arc::new(self.clone())) }
    }
}
