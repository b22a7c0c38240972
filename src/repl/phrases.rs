//! `:phrase`: sentences that people teach, judged before they are learnt, kept in a file and taken back.
//!
//! What a sentence comes to, and what is asked before it is done, is in `sentences`; what can be known of a phrase from its text
//! alone is the language's.

use std::path::{Path, PathBuf};

use crate::files::{self, write};
use crate::language::sentence::{self, Knowledge, Phrase, Reach, Wrong};
use crate::report::{Failure, Style};

use super::Session;

/// Phrases that people taught, kept in a file when there is a place for one.
pub(super) struct Taught {
    phrases: Vec<(String, Phrase)>,
    path: Option<PathBuf>,
}

impl Taught {
    /// Reads the phrases kept in a folder; tells of those that cannot be read any more.
    pub(super) fn read(home: Option<&Path>, style: Style) -> Self {
        let path = home.map(|home| home.join("phrases"));
        let mut taught = Self { phrases: Vec::new(), path };
        taught.read_again(style);
        taught
    }

    /// Reads the file anew; phrases of this session that are in no file are kept as they are.
    pub(super) fn read_again(&mut self, style: Style) {
        let Some(path) = &self.path else { return };
        let text = files::read::text(path).ok();
        let mut phrases = Vec::new();
        for line in text.unwrap_or_default().lines().filter(|line| !line.trim().is_empty()) {
            match sentence::phrase(line) {
                Ok(phrase) => phrases.push((line.to_owned(), phrase)),
                Err(wrong) => {
                    style.note(&format!("phrase {line} is passed over: {}", wrong.message));
                }
            }
        }
        self.phrases = phrases;
    }

    pub(super) fn all(&self) -> Vec<Phrase> {
        self.phrases.iter().map(|(_, phrase)| phrase.clone()).collect()
    }

    /// Whether a line is a sentence that was taught, whatever its slots are filled with.
    pub(super) fn hears(&self, line: &str) -> bool {
        let said = sentence::words(line);
        let fits = |phrase: &Phrase| phrase.template.fit(&said, Reach::Short).is_some();
        self.phrases.iter().any(|(_, phrase)| fits(phrase))
    }

    /// Learns a phrase; returns the file it is kept in with the texts before and after.
    fn learn(&mut self, line: &str, phrase: Phrase) -> Result<Option<Kept>, Failure> {
        self.phrases.retain(|(_, known)| known.template.text != phrase.template.text);
        self.phrases.push((line.to_owned(), phrase));
        self.keep("the phrase is known now")
    }

    /// Forgets the phrase of a sentence, all of them where none is named; returns the file as [`Self::learn`] does.
    fn forget(&mut self, wanted: &str) -> Result<Option<Kept>, Failure> {
        let before = self.phrases.len();
        // With or without its marks, and with the call behind it as the list has it.
        let bare = wanted.trim_start_matches('"');
        let bare = bare.split_once('"').map_or(bare, |(sentence, _)| sentence);
        self.phrases.retain(|(_, known)| !wanted.is_empty() && known.template.text != bare);
        if self.phrases.len() == before && !wanted.is_empty() {
            let words = format!("no phrase \"{bare}\" was taught");
            return Err(Failure::input("repl::phrase", words).help("`:phrase` lists them"));
        }
        self.keep("the phrase is forgotten now")
    }

    /// Writes the file, where there is a place for one; `done` is what holds even if that fails.
    fn keep(&self, done: &str) -> Result<Option<Kept>, Failure> {
        let Some(path) = &self.path else { return Ok(None) };
        let before = files::read::text(path).ok();
        if before.is_none() && self.phrases.is_empty() {
            return Ok(None);
        }
        let lines: Vec<&str> = self.phrases.iter().map(|(line, _)| line.as_str()).collect();
        let after = if lines.is_empty() { String::new() } else { lines.join("\n") + "\n" };
        write::replace(path, &after).map_err(|error| {
            let mut failure = Failure::unwritten(path, &error);
            failure.message = format!("{done}, and cannot be kept: {}", failure.message);
            failure
        })?;
        Ok(Some(Kept { path: path.clone(), before, after }))
    }
}

/// The file of phrases as it was and is.
struct Kept {
    path: PathBuf,
    before: Option<String>,
    after: String,
}

fn refused(code: &'static str, wrong: Wrong) -> Failure {
    Failure::input(code, wrong.message).help(wrong.help)
}

impl Session<'_, '_> {
    /// `:phrase "empty the {o}" = pour(o, cup)`; alone it lists what was taught, and `:phrase clear "empty the {o}"` takes one
    /// back.
    pub(super) fn phrase(&mut self, line: &str) -> Result<(), Failure> {
        if let Some(wanted) = line.strip_prefix("clear")
            && (wanted.is_empty() || wanted.starts_with([' ', '"']))
        {
            let before = self.taught.phrases.len();
            let kept = self.taught.forget(wanted.trim())?;
            let forgotten = before - self.taught.phrases.len();
            let back = if kept.is_some() { "; `:undo-edit` brings them back" } else { "" };
            self.note_change(kept);
            if forgotten > 1 {
                self.style.say(format!("{forgotten} phrases are forgotten{back}"));
            } else {
                self.list_phrases();
            }
            return Ok(());
        }
        if line.is_empty() {
            self.list_phrases();
            return Ok(());
        }
        let phrase = sentence::phrase(line).map_err(|wrong| refused("task::template", wrong))?;
        let name = &phrase.call.name.text;
        if self.library.callable(name).is_none() {
            let words = format!("there is no task or action `{name}`");
            return Err(Failure::input("task::unknown_name", words)
                .help("`:tasks` lists what can be called"));
        }
        let displaced = self.judged(&phrase)?;
        let sentence = phrase.template.text.clone();
        let kept = self.taught.learn(line, phrase)?;
        let words = if kept.is_some() { "kept for later sessions" } else { "for this session" };
        self.note_change(kept);
        self.style.say(format!("understood, {words}"));
        if let Some((said, call)) = displaced {
            self.style.say(format!(
                "  \"{said}\" meant {call} until now; `:phrase clear \"{sentence}\"` gives it back"
            ));
        }
        Ok(())
    }

    /// Says why a phrase is not learnt, or which sentence means something else with it, and the call that it means without.
    fn judged(&self, phrase: &Phrase) -> Result<Option<(String, String)>, Failure> {
        let scene = self.library.scene(self.library.default_scene());
        let things = scene.map(|(scene, _)| sentence::things(scene)).unwrap_or_default();
        let with = Knowledge::on_paper(&self.library, &things);
        sentence::sound(phrase, &with).map_err(|wrong| refused("repl::phrase", wrong))?;
        let words = sentence::single_words(phrase);
        if let Some(word) = words.iter().find(|word| self.is_taken(word)) {
            let words = format!("`{word}` alone means something already");
            return Err(Failure::input("repl::phrase", words)
                .help("add a word to it, so that it is a sentence"));
        }
        Ok(sentence::displaced(phrase, &with))
    }

    fn list_phrases(&self) {
        if self.taught.phrases.is_empty() {
            self.style.say("no phrase was taught yet: `:phrase \"empty the {o}\" = pour(o, cup)`");
        }
        for (line, _) in &self.taught.phrases {
            self.style.say(line);
        }
    }

    /// Takes note of a change of the file, so that it can be undone.
    fn note_change(&mut self, kept: Option<Kept>) {
        if let Some(Kept { path, before, after }) = kept {
            self.edits.made(":phrase", &path, before, &after);
        }
    }
}
