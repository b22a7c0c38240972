//! Recordings that cannot be read: what is wrong with one, what a file in another form is, and the one step that makes of it what is read.

use std::io::Read as _;
use std::path::Path;

use crate::discovery::recording;
use crate::files;
use crate::report::Failure;

/// What a recording comes in that is not read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Form {
    Sqlite,
    RosOne,
    Parquet,
    Arrow,
    Hdf5,
    Matlab,
    Numpy,
    Spreadsheet,
    Zip,
    Gzip,
    Zstd,
    Bzip2,
    Xz,
    Utf16,
}

/// Each form, what its files begin with, and how their names end. Of several that begin alike the first is meant where the
/// ending does not tell.
const KNOWN: &[(Form, &[u8], &[&str])] = &[
    (Form::Sqlite, b"SQLite format 3\0", &["db3"]),
    (Form::RosOne, b"#ROSBAG V", &["bag"]),
    (Form::Parquet, b"PAR1", &["parquet", "pq"]),
    (Form::Arrow, b"ARROW1", &["arrow", "feather"]),
    (Form::Arrow, b"FEA1", &["feather"]),
    (Form::Hdf5, b"\x89HDF\r\n\x1a\n", &["h5", "hdf5", "hdf"]),
    (Form::Matlab, b"MATLAB ", &["mat"]),
    (Form::Numpy, b"\x93NUMPY", &["npy"]),
    (Form::Zip, b"PK\x03\x04", &["zip"]),
    (Form::Numpy, b"PK\x03\x04", &["npz"]),
    (Form::Spreadsheet, b"PK\x03\x04", &["xlsx", "ods"]),
    (Form::Gzip, b"\x1f\x8b", &["gz"]),
    (Form::Zstd, b"\x28\xb5\x2f\xfd", &["zst", "zstd"]),
    (Form::Bzip2, b"BZh", &["bz2"]),
    (Form::Xz, b"\xfd7zXZ\0", &["xz"]),
    (Form::Utf16, b"\xff\xfe", &[]),
    (Form::Utf16, b"\xfe\xff", &[]),
];

/// Bytes that tell a form.
const HEAD: u64 = 16;

/// Says what is wrong with a recording.
pub(super) fn failure(error: &recording::Error) -> Failure {
    Failure::input("gap::recording", error.what.clone()).at(&error.place).help(&error.help)
}

/// Says what a file is that is no text, if that is known.
pub(super) fn told(path: &Path) -> Option<Failure> {
    let mut head = Vec::new();
    let file = files::read::open(path, u64::MAX).ok()?;
    file.take(HEAD).read_to_end(&mut head).ok()?;
    Some(refused(path, form(&head, path)?))
}

/// Says of a bag that none of its files is read, of which `file` is one.
pub(super) fn bag(folder: &Path, file: &Path) -> Failure {
    let packed = file.extension().is_some_and(|ending| ending != "db3");
    if packed { refused(file, Form::Zstd) } else { refused(folder, Form::Sqlite) }
}

/// Returns the form of a file that begins so: by what it begins with, else by its ending.
fn form(head: &[u8], path: &Path) -> Option<Form> {
    let ending = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    let find = |is: &dyn Fn(bool, bool) -> bool| {
        let has = |(_, begins, endings): &&(Form, &[u8], &[&str])| {
            is(head.starts_with(begins), endings.contains(&ending.as_str()))
        };
        KNOWN.iter().find(has).map(|(form, ..)| *form)
    };
    find(&|begins, ends| begins && ends)
        .or_else(|| find(&|begins, _| begins))
        .or_else(|| find(&|_, ends| ends))
}

fn refused(path: &Path, form: Form) -> Failure {
    let message = format!("this is {}; a recording is read from CSV or MCAP", form.words());
    Failure::input("gap::format", message).at(path.display().to_string()).help(form.step(path))
}

impl Form {
    fn words(self) -> &'static str {
        match self {
            Self::Sqlite => "a ROS 2 bag in SQLite (`.db3`)",
            Self::RosOne => "a bag of ROS 1",
            Self::Parquet => "a table in Parquet",
            Self::Arrow => "a table in Arrow (Feather)",
            Self::Hdf5 => "a file in HDF5",
            Self::Matlab => "a file of MATLAB",
            Self::Numpy => "a file of NumPy",
            Self::Spreadsheet => "a spreadsheet",
            Self::Zip => "an archive (zip)",
            Self::Gzip | Self::Zstd | Self::Bzip2 | Self::Xz => "a compressed file",
            Self::Utf16 => "text in UTF-16",
        }
    }

    /// Says what makes a file of it that is read.
    fn step(self, path: &Path) -> String {
        let from = path.display();
        let bare = path.with_extension("");
        let bare = bare.display();
        let pandas = |reader: &str| {
            format!(
                "`python3 -c \"import pandas; pandas.{reader}('{from}').to_csv('{bare}.csv', index=False)\"` makes a CSV \
                 file of it, with columns as `q_1[rad]`"
            )
        };
        match self {
            Self::Sqlite => format!(
                "`ros2 bag convert -i {from} -o convert.yaml` makes a bag in MCAP of it, where convert.yaml holds \
                 `output_bags: [{{uri: {bare}_mcap, storage_id: mcap, all: true}}]`; `ros2 bag record -s mcap` \
                 records one"
            ),
            Self::RosOne => format!(
                "`rosbags-convert --src {from} --dst {bare} --dst-storage mcap` makes a bag of ROS 2 of it \
                 (`pip install rosbags`)"
            ),
            Self::Parquet => pandas("read_parquet"),
            Self::Arrow => pandas("read_feather"),
            Self::Hdf5 | Self::Numpy => {
                let reader = if self == Self::Hdf5 { "h5py.File" } else { "numpy.load" };
                format!(
                    "read its columns with `{reader}` in Python; `pandas.DataFrame({{'t[s]': t, 'q_1[rad]': q1}})\
                     .to_csv('{bare}.csv', index=False)` makes a CSV file of them"
                )
            }
            Self::Matlab => format!(
                "in MATLAB, `writetable(array2table([t q], 'VariableNames', {{'t[s]','q_1[rad]'}}), '{bare}.csv')` \
                 makes a CSV file of its columns"
            ),
            Self::Spreadsheet => "save it as CSV in UTF-8".to_owned(),
            Self::Zip => format!("`unzip {from}` takes out what is in it"),
            Self::Gzip => format!("unpack it with `gunzip -k {from}`"),
            Self::Zstd => format!("unpack it with `zstd -d {from}`"),
            Self::Bzip2 => format!("unpack it with `bunzip2 -k {from}`"),
            Self::Xz => format!("unpack it with `unxz -k {from}`"),
            Self::Utf16 => {
                format!("`iconv -f UTF-16 -t UTF-8 {from} > {bare}_utf8.csv` writes it in UTF-8")
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_form_is_known_by_its_first_bytes_and_where_they_say_nothing_by_its_ending() {
        let cases: [(&[u8], &str, Option<Form>); 10] = [
            (b"SQLite format 3\0\x10\0", "walk.db3", Some(Form::Sqlite)),
            (b"PAR1\x15\x04", "walk.csv", Some(Form::Parquet)),
            (b"PK\x03\x04\x14", "walk.npz", Some(Form::Numpy)),
            (b"PK\x03\x04\x14", "walk.XLSX", Some(Form::Spreadsheet)),
            (b"PK\x03\x04\x14", "walk", Some(Form::Zip)),
            (b"\x1f\x8b\x08", "walk.csv.gz", Some(Form::Gzip)),
            (b"\xff\xfet\0[\0", "walk.csv", Some(Form::Utf16)),
            (b"\xff\xff\xff\xff", "walk.arrow", Some(Form::Arrow)),
            (b"", "walk.mat", Some(Form::Matlab)),
            (b"\xe4;t", "walk.csv", None),
        ];
        for (head, name, expected) in cases {
            assert_eq!(form(head, Path::new(name)), expected, "{name}");
        }
    }

    #[test]
    fn what_helps_fits_into_what_is_told() {
        for (form, ..) in KNOWN {
            let failure = refused(Path::new("logs/monday/walk.dat"), *form);
            let help = failure.help.unwrap();
            assert!(help.len() > 20 && !help.ends_with('…'), "{form:?}: {help}");
        }
    }
}
