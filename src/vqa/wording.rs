//! What a model is told and asked beside the questions of fluents.

/// What the model is told before every question.
pub(super) const SYSTEM: &str = "You check one photo of a robot workspace. \
    Answer only about what the photo shows. If it is hidden or unclear, answer unsure. \
    Reply as JSON: {\"evidence\": <15 words or fewer>, \"answer\": \"yes\"|\"no\"|\"unsure\"}.";

/// What no form but an enforced one survives.
pub(super) const ESSAY: &str =
    "Write an essay of five paragraphs about this picture. Do not use JSON.";
/// What is red on one picture and blue on its mirror.
pub(super) const RED: &str = "Is the left half of the picture red?";
