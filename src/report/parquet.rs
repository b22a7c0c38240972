//! Trials as a Parquet file, for pandas and R: a row a trial, columns flat and typed, named as in the JSON.
//!
//! What a trial does not have is null. Columns are not compressed: a trial is a few hundred bytes.

use std::sync::Arc;

use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use parquet::schema::types::Type;

use crate::workcell::trials::Trial;

/// The three regressions, of which some are left out.
const REGRESSIONS: [(u8, &str); 3] =
    [(1, "without_regression_1"), (2, "without_regression_2"), (3, "without_regression_3")];

/// A column, an entry a trial.
enum Column {
    Count(Vec<u64>),
    Flag(Vec<Option<bool>>),
    Number(Vec<Option<f64>>),
    Text(Vec<Option<String>>),
}

impl Column {
    fn field(&self, name: &str) -> Result<Type, ParquetError> {
        let (physical, logical) = match self {
            Self::Count(_) => {
                (Physical::INT64, Some(LogicalType::Integer { bit_width: 64, is_signed: false }))
            }
            Self::Flag(_) => (Physical::BOOLEAN, None),
            Self::Number(_) => (Physical::DOUBLE, None),
            Self::Text(_) => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
        };
        let always = matches!(self, Self::Count(_));
        let often = if always { Repetition::REQUIRED } else { Repetition::OPTIONAL };
        let field = Type::primitive_type_builder(name, physical);
        field.with_logical_type(logical).with_repetition(often).build()
    }

    fn write(self, column: &mut SerializedColumnWriter<'_>) -> Result<(), ParquetError> {
        match self {
            Self::Count(values) => {
                // The bits are those of the unsigned number, as the column says.
                let values: Vec<i64> = values.into_iter().map(u64::cast_signed).collect();
                column.typed::<Int64Type>().write_batch(&values, None, None)?;
            }
            Self::Flag(values) => {
                let (levels, values) = present(values);
                column.typed::<BoolType>().write_batch(&values, Some(&levels), None)?;
            }
            Self::Number(values) => {
                let (levels, values) = present(values);
                column.typed::<DoubleType>().write_batch(&values, Some(&levels), None)?;
            }
            Self::Text(values) => {
                let (levels, values) = present(values);
                let values: Vec<ByteArray> =
                    values.into_iter().map(|text| text.into_bytes().into()).collect();
                column.typed::<ByteArrayType>().write_batch(&values, Some(&levels), None)?;
            }
        }
        Ok(())
    }
}

/// Returns which are there (1) and which not (0), and those that are.
fn present<T>(values: Vec<Option<T>>) -> (Vec<i16>, Vec<T>) {
    let levels = values.iter().map(|value| i16::from(value.is_some())).collect();
    (levels, values.into_iter().flatten().collect())
}

/// Returns trials as a Parquet file.
///
/// # Errors
///
/// What the writer of the format says.
pub fn file(trials: &[Trial]) -> Result<Vec<u8>, ParquetError> {
    let columns = columns(trials);
    let fields = columns.iter().map(|(name, column)| Ok(Arc::new(column.field(name)?)));
    let fields = fields.collect::<Result<Vec<_>, ParquetError>>()?;
    let schema = Arc::new(Type::group_type_builder("trial").with_fields(fields).build()?);
    let by = concat!("trueup ", env!("CARGO_PKG_VERSION")).to_owned();
    let properties = Arc::new(WriterProperties::builder().set_created_by(by).build());
    let mut bytes = Vec::new();
    let mut writer = SerializedFileWriter::new(&mut bytes, schema, properties)?;
    let mut rows = writer.next_row_group()?;
    for (_, values) in columns {
        let Some(mut column) = rows.next_column()? else { break };
        values.write(&mut column)?;
        column.close()?;
    }
    rows.close()?;
    writer.close()?;
    Ok(bytes)
}

fn columns(trials: &[Trial]) -> Vec<(&'static str, Column)> {
    let numbers =
        |of: &dyn Fn(&Trial) -> Option<f64>| Column::Number(trials.iter().map(of).collect());
    let flags = |of: &dyn Fn(&Trial) -> Option<bool>| Column::Flag(trials.iter().map(of).collect());
    let texts =
        |of: &dyn Fn(&Trial) -> Option<String>| Column::Text(trials.iter().map(of).collect());
    let mut columns = vec![
        ("seed", Column::Count(trials.iter().map(|trial| trial.seed).collect())),
        ("task", texts(&|trial| Some(trial.task.clone()))),
    ];
    for (number, name) in REGRESSIONS {
        columns.push((name, flags(&|trial| Some(trial.without.contains(&number)))));
    }
    let matching = |trial: &Trial| trial.matching.clone();
    columns.extend([
        ("outcome", texts(&|trial| trial.outcome.map(|ending| ending.word().to_owned()))),
        ("picked", flags(&|trial| trial.picked)),
        ("poured", flags(&|trial| trial.poured)),
        ("in_target_ml", numbers(&|trial| trial.in_target_ml)),
        ("spilt_ml", numbers(&|trial| trial.spilt_ml)),
        ("reason", texts(&|trial| trial.reason.clone())),
        ("match_camera", numbers(&|trial| Some(matching(trial)?.camera?.probability))),
        ("match_scene", numbers(&|trial| matching(trial)?.scene)),
        ("match_robot", numbers(&|trial| Some(matching(trial)?.robot?.probability))),
        ("match_probability", numbers(&|trial| matching(trial)?.probability)),
        ("total_s", numbers(&|trial| Some(trial.total_s))),
        ("arm_s", numbers(&|trial| Some(trial.arm_s))),
        ("run_dir", texts(&|trial| trial.run_dir.clone())),
        ("setup", texts(&|trial| Some(trial.setup.clone()))),
    ]);
    columns
}
