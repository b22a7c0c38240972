//! The built program as a stranger runs it: arguments and input in; exit code, stdout and stderr out.

use std::fs;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use serde_json::Value;

use crate::schema::Schemas;

/// A folder of its own to run the program in, empty at the start.
pub(crate) struct Scratch {
    dir: PathBuf,
}

/// What the program said.
#[derive(Debug)]
pub(crate) struct Said {
    pub(crate) code: i32,
    pub(crate) out: String,
    pub(crate) err: String,
}

impl Scratch {
    /// Clears a scratch; each test takes a name of its own, for tests run side by side.
    pub(crate) fn new(name: &str) -> Self {
        let dir = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
        let _ = fs::remove_dir_all(&dir);
        fs::create_dir_all(&dir).unwrap();
        Self { dir }
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.dir.join(name)
    }

    /// Puts a file on the scratch.
    pub(crate) fn file(&self, name: &str, text: impl AsRef<[u8]>) {
        let path = self.path(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }

    /// Returns the program, ready to run on the scratch, without the user's colours and history.
    pub(crate) fn command(&self, args: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_trueup"));
        command
            .args(args)
            .current_dir(&self.dir)
            .env_remove("NO_COLOR")
            .env("XDG_STATE_HOME", &self.dir)
            .env("XDG_CACHE_HOME", &self.dir)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        command
    }

    /// Runs the program to its end.
    pub(crate) fn trueup(&self, args: &[&str]) -> Said {
        Said::of(args, self.command(args).output().unwrap())
    }

    /// Runs the program to its end where no file may grow beyond so many blocks of 512 bytes.
    #[cfg(unix)]
    pub(crate) fn without_room(&self, blocks: usize, args: &[&str]) -> Said {
        Said::of(args, self.without_more(blocks, args).output().unwrap())
    }

    /// As [`Self::without_room`], on typed input.
    #[cfg(unix)]
    pub(crate) fn without_room_typed(&self, blocks: usize, args: &[&str], input: &str) -> Said {
        let mut child = self.without_more(blocks, args).stdin(Stdio::piped()).spawn().unwrap();
        child.stdin.take().unwrap().write_all(input.as_bytes()).unwrap();
        Said::of(args, child.wait_with_output().unwrap())
    }

    #[cfg(unix)]
    fn without_more(&self, blocks: usize, args: &[&str]) -> Command {
        // The signal that comes with the error is left out: a full disk sends none.
        self.limited(&format!("trap '' XFSZ; ulimit -f {blocks}"), args)
    }

    /// Returns the program, ready to run after what a shell is told first.
    #[cfg(unix)]
    pub(crate) fn limited(&self, first: &str, args: &[&str]) -> Command {
        let plain = self.command(args);
        let mut command = Command::new("sh");
        command.arg("-c").arg(format!("{first}; exec \"$@\"")).arg("sh");
        command.arg(plain.get_program()).args(plain.get_args()).current_dir(&self.dir);
        for (name, value) in plain.get_envs() {
            match value {
                Some(value) => command.env(name, value),
                None => command.env_remove(name),
            };
        }
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        command
    }

    /// Runs the program on typed input and returns what a terminal would show: stdout and stderr as one.
    pub(crate) fn typed(&self, args: &[&str], input: &str) -> Said {
        self.typed_with(args, input, ("NO_COLOR", ""))
    }

    /// As [`Self::typed`], with one more variable in the environment.
    pub(crate) fn typed_with(&self, args: &[&str], input: &str, more: (&str, &str)) -> Said {
        let (mut screen, end) = std::io::pipe().unwrap();
        let mut child = self
            .command(args)
            .env(more.0, more.1)
            .stdin(Stdio::piped())
            .stdout(end.try_clone().unwrap())
            .stderr(end)
            .spawn()
            .unwrap();
        let mut keys = child.stdin.take().unwrap();
        let input = input.to_owned();
        let typing = std::thread::spawn(move || {
            // A program that leaves early closes its input.
            let _ = keys.write_all(input.as_bytes());
        });
        let mut out = String::new();
        screen.read_to_string(&mut out).unwrap();
        typing.join().unwrap();
        let code = child.wait().unwrap().code().unwrap();
        Said { code, out, err: String::new() }
    }

    /// Returns the names of everything on the scratch, folders first searched, in order.
    pub(crate) fn everything(&self) -> Vec<String> {
        let (mut found, mut open) = (Vec::new(), vec![self.dir.clone()]);
        while let Some(dir) = open.pop() {
            for entry in fs::read_dir(dir).unwrap() {
                let path = entry.unwrap().path();
                found.push(path.strip_prefix(&self.dir).unwrap().display().to_string());
                if path.is_dir() {
                    open.push(path);
                }
            }
        }
        found.sort();
        found
    }

    /// Returns the one run folder in `root`.
    pub(crate) fn run_folder(&self, root: &str) -> PathBuf {
        let mut folders: Vec<_> =
            fs::read_dir(self.path(root)).unwrap().map(|entry| entry.unwrap().path()).collect();
        assert_eq!(folders.len(), 1, "{folders:?}");
        folders.remove(0)
    }
}

impl Said {
    fn of(args: &[&str], output: std::process::Output) -> Self {
        let said = Self {
            code: output.status.code().unwrap_or(-1),
            out: String::from_utf8(output.stdout).unwrap(),
            err: String::from_utf8(output.stderr).unwrap(),
        };
        let is_mistake = ["panicked", "internal error"].iter().any(|word| said.err.contains(word))
            || said.out.contains("\"code\": \"internal::error\"");
        assert!(!is_mistake, "trueup {args:?}: {}{}", said.out, said.err);
        let coloured = said.out.contains('\x1b') || said.err.contains('\x1b');
        assert!(!coloured, "trueup {args:?}: colour in a pipe: {said:?}");
        said
    }

    /// Returns stdout as the one JSON document it must be.
    pub(crate) fn json(&self) -> Value {
        serde_json::from_str(&self.out).unwrap_or_else(|error| panic!("{error} in {}", self.out))
    }

    /// Returns the JSON document that stdout must be, held to its schema.
    pub(crate) fn document(&self, schema: &str) -> Value {
        let document = self.json();
        Schemas::read().holds(schema, &document);
        document
    }

    /// Returns one field of the error that stdout must be.
    pub(crate) fn error(&self, field: &str) -> String {
        let document = self.json();
        let error = document["error"].as_object().unwrap_or_else(|| panic!("{}", self.out));
        assert!(error.keys().eq(["code", "help", "message", "where"]), "{}", self.out);
        error[field].as_str().unwrap_or_default().to_owned()
    }
}

/// A file of the project.
pub(crate) fn project(path: &str) -> String {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path).display().to_string()
}
