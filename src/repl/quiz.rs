//! `:quiz`: questions over the runs that are kept, by their pictures, the hardest last.

use crate::report::Failure;
use crate::report::teach::compared;
use crate::teach::answers::{self, Answer, Answered, TRAINEE};
use crate::teach::quiz;
use crate::workcell::picture;

use super::line_source::Typed;
use super::{Next, Session};

/// What a line may say to a question.
const LEGEND: &str = "  y yes   n no   u can't tell   Enter leaves it out   quit";

/// What a line says to a question.
enum Said {
    Answer(Answer),
    /// It is left out.
    Nothing,
    /// The quiz ends.
    Enough,
}

impl Session<'_, '_> {
    /// `:quiz [TASK|FLUENT]`: asks until all are answered, or somebody has had enough. Nothing moves.
    pub(super) fn quiz(&mut self, about: &str) -> Result<(), Failure> {
        let kept: Vec<_> = self
            .entries()
            .into_iter()
            .filter_map(|entry| Some((entry.load().ok()?, entry)))
            .collect();
        let steps: Vec<_> = kept.iter().map(|(run, _)| run.steps.as_slice()).collect();
        let shown = |run: usize, number: usize| {
            picture::file(&kept[run].1.dir, &picture::after(number, "real"))
        };
        // The same order every time: what was skipped is found again.
        let mut items = quiz::ordered(&steps, &|run, step| shown(run, step.number).is_file(), 1);
        let head = |text: &str| text.split('(').next().unwrap_or_default().to_owned();
        items.retain(|item| {
            let row = &steps[item.run][item.step].fluents[item.row];
            about.is_empty() || head(&kept[item.run].0.task) == about || head(&row.name) == about
        });
        if items.is_empty() {
            let about = if about.is_empty() { String::new() } else { format!(" about `{about}`") };
            let words = format!("no run that is kept has a question{about} and a picture");
            return Err(Failure::no("repl::quiz", words).help(
                "`:quiz`, `:quiz pour` or `:quiz above`; a call at the prompt keeps its run",
            ));
        }
        let file = self.hands.record.join(answers::FILE);
        for (at, item) in items.iter().enumerate() {
            let (entry, step) = (&kept[item.run].1, &steps[item.run][item.step]);
            let row = &step.fluents[item.row];
            self.forget_typed();
            self.style.say(format!(
                "run {}, after step {} {}\n  picture  {}\n{}\n{LEGEND}",
                entry.number,
                step.number,
                step.action,
                shown(item.run, step.number).display(),
                row.ask.as_deref().unwrap_or(&row.name),
            ));
            let said = match self.quiz_answer(&format!("quiz {}/{}> ", at + 1, items.len())) {
                Said::Answer(said) => said,
                Said::Nothing => continue,
                Said::Enough => break,
            };
            let both = Answered::new(TRAINEE, &entry.name, step, row, said);
            let Some(answered) = both else { continue };
            if let Err(error) = answers::append(&file, &answered) {
                self.fail(&Failure::unwritten(&file, &error));
            }
            self.style.say(compared(&answered, "", self.style));
        }
        self.progress(&file)
    }

    /// Reads lines until one answers the question, leaves it out or ends the quiz.
    fn quiz_answer(&mut self, prompt: &str) -> Said {
        loop {
            let line = match self.typed(prompt) {
                Ok(Typed::Statement(line)) => line,
                Ok(Typed::Interrupted | Typed::End) => return Said::Enough,
                Err(failure) => {
                    self.fail(&failure);
                    return Said::Enough;
                }
            };
            match line.trim() {
                "" => return Said::Nothing,
                "quit" | ":quit" | "q" | ":q" | "exit" | "stop" | ":stop" => return Said::Enough,
                "?" | "help" | ":help" => self.style.say(LEGEND),
                word => {
                    if let Some(answer) = Answer::parse(word) {
                        return Said::Answer(answer);
                    }
                    if word.starts_with(['?', '!']) {
                        if self.survive(word) == Next::Quit {
                            return Said::Enough;
                        }
                    } else {
                        let words = format!("`{word}` is no answer: y, n or u, Enter, or quit");
                        self.style.say(words);
                    }
                }
            }
        }
    }

    /// Says how often the answers so far were geometry's, fluent by fluent.
    fn progress(&self, file: &std::path::Path) -> Result<(), Failure> {
        let (all, _) = answers::read(file).map_err(|error| Failure::unread(file, &error))?;
        let told: Vec<String> = answers::progress(&all)
            .into_iter()
            .filter(|((by, _), tally)| by == TRAINEE && tally.of > 0)
            .map(|((_, fluent), tally)| format!("{fluent} {} of {}", tally.right, tally.of))
            .collect();
        if !told.is_empty() {
            self.style.say(format!("correct so far: {}", told.join(", ")));
        }
        Ok(())
    }
}
