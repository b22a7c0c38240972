//! What the service says and does of `sequences`; what it keeps is in [`super::super::sequences`].

use super::super::call::{Answer, Ask, done, say};
use super::super::controller::Controller;
use super::super::error::Refused;
use super::super::sequences::Playing;
use super::super::sessions::Session;
use crate::kortex::messages::base::{ConfigurationChange, ConfigurationNotificationEvent};
use crate::kortex::messages::sequence::{
    Sequence, SequenceEvent, SequenceHandle, SequenceInfoNotification, SequenceList,
};
use crate::kortex::refusal;
use crate::kortex::rpc::base as call;

impl Controller {
    /// The calls about sequences; `None` for any other.
    pub(in crate::emulator) fn sequence_calls(&mut self, ask: &Ask<'_>) -> Option<Answer> {
        use ConfigurationNotificationEvent as Event;
        Some(match ask.rpc {
            call::CREATE_SEQUENCE => ask.read().and_then(|sequence| {
                let handle = self.sequences.store(sequence);
                let change = ConfigurationChange::SequenceHandle(handle.clone());
                self.tell_change(ask, Event::Created, change);
                say(&handle)
            }),
            call::UPDATE_SEQUENCE => ask.read().and_then(|sequence: Sequence| {
                let handle = sequence.handle.clone().unwrap_or_default();
                let at = self.sequences.at(&handle)?;
                self.sequences.stored[at] = sequence;
                self.tell_change(ask, Event::Updated, ConfigurationChange::SequenceHandle(handle));
                done()
            }),
            call::DELETE_SEQUENCE => ask.read().and_then(|handle: SequenceHandle| {
                let at = self.sequences.at(&handle)?;
                self.sequences.stored.remove(at);
                self.tell_change(ask, Event::Deleted, ConfigurationChange::SequenceHandle(handle));
                done()
            }),
            call::READ_SEQUENCE => ask.read().and_then(|handle| {
                let at = self.sequences.at(&handle)?;
                say(&self.sequences.stored[at])
            }),
            call::READ_ALL_SEQUENCES => {
                say(&SequenceList { sequence_list: self.sequences.stored.clone() })
            }
            call::PLAY_SEQUENCE => ask.read().and_then(|handle| self.play_sequence(ask, &handle)),
            call::STOP_SEQUENCE => {
                self.stop_all(refusal::CONTROL_MANUAL_STOP);
                done()
            }
            call::PAUSE_SEQUENCE => self.pause_sequence(true),
            call::RESUME_SEQUENCE => self.pause_sequence(false),
            _ => return None,
        })
    }

    /// Begins to play a stored sequence.
    pub(in crate::emulator) fn play_sequence(
        &mut self,
        ask: &Ask<'_>,
        handle: &SequenceHandle,
    ) -> Answer {
        self.may_command(ask)?;
        self.must_rest()?;
        if self.sequences.is_playing() {
            return Err(Refused::Playing);
        }
        let sequence = self.sequences.stored[self.sequences.at(handle)?].clone();
        let (session, peer) = (ask.session, ask.peer);
        self.sequences.playing = Some(Playing { sequence, task: 0, session, peer });
        self.tell_sequence(SequenceEvent::Started, 0);
        self.begin_task(ask.now);
        done()
    }

    fn pause_sequence(&mut self, is_paused: bool) -> Answer {
        if !self.sequences.is_playing() {
            return Err(Refused::NothingPlayed);
        }
        let paused = self.pause(is_paused);
        if is_paused && paused.is_ok() {
            self.tell_sequence(SequenceEvent::Paused, 0);
        }
        paused
    }

    /// Begins the task whose turn it is, or says that the sequence is over.
    fn begin_task(&mut self, now: f64) {
        let Some(Playing { sequence, task, session, peer }) = self.sequences.playing.clone() else {
            return;
        };
        let Some(next) = sequence.tasks.get(task) else {
            self.tell_sequence(SequenceEvent::Completed, 0);
            self.sequences.playing = None;
            return;
        };
        self.tell_sequence(SequenceEvent::TaskStarted, 0);
        let ask = Ask { rpc: call::PLAY_SEQUENCE, peer, session, device: 0, payload: &[], now };
        if let Err(no) = self.execute(&ask, next.action.clone().unwrap_or_default(), None) {
            self.abort_sequence(no.sub_code());
        }
    }

    /// Goes on with the next task once one is over.
    pub(in crate::emulator) fn play_on(&mut self, now: f64) {
        if !self.sequences.is_playing() || self.actions.is_running() {
            return;
        }
        self.tell_sequence(SequenceEvent::TaskCompleted, 0);
        if let Some(playing) = &mut self.sequences.playing {
            playing.task += 1;
        }
        self.begin_task(now);
    }

    /// Gives up the sequence, if one is played.
    pub(in crate::emulator) fn abort_sequence(&mut self, sub_code: u16) {
        if self.sequences.is_playing() {
            self.tell_sequence(SequenceEvent::Aborted, sub_code);
            self.sequences.playing = None;
        }
    }

    fn tell_sequence(&mut self, event: SequenceEvent, sub_code: u16) {
        let Some(playing) = &self.sequences.playing else { return };
        let task = playing.sequence.tasks.get(playing.task);
        let holder = self.sessions.holder();
        let told = SequenceInfoNotification {
            event_identifier: event as i32,
            sequence_handle: playing.sequence.handle.clone(),
            task_index: playing.task as u32,
            group_identifier: task.map_or(0, |task| task.group_identifier),
            timestamp: Some(self.timestamp()),
            user_handle: holder.map(Session::user_handle),
            abort_details: i32::from(sub_code),
            connection: holder.map(Session::connection),
        };
        self.topics.tell(call::ON_SEQUENCE_INFO_TOPIC, &told);
    }
}
