//! `ground calibrate rate-table` and `multi-position`: controlled inputs, from a table or from a raw log's stretches at
//! rest.

use std::path::{Path, PathBuf};

use logs::units::Units;

use super::{CalibrateError, Output, TableArguments, read_nominal};
use crate::{
    checks,
    controlled::{self, Calibration, Contradicted, Options},
    experiment::{Excitation, Experiment, Layout},
    lean, log,
    nominal::{Nominal, NominalChannel},
    report::{self, Leftover, Report},
    response::Orders,
    set::Entry,
    stretches::{self, Stretch},
    table::{self, Table},
    wiring::surely_inverted,
};

/// A left-out error this many times the scatter says that the calibration does not carry over.
const CARRIES_OVER: f64 = 3.0;

/// Gyros, from runs on a rate table
///
/// One row a run: rates in b (wx_rad_s wy_rad_s wz_rad_s, or wx_deg_s ..) or angles (inner_deg outer_deg turning
/// rate_deg_s) or both, then a mean a channel. Finds rows that contradict the data, exchanged and inverted channels.
#[derive(Clone, Debug, clap::Args)]
pub struct RateTable {
    #[command(flatten)]
    common: Common,
}

/// Accelerometers, from many positions
///
/// One row a position: specific force in b (fx_m_s2 .., or fx_g ..) or table angles (inner_deg outer_deg), then a mean a
/// channel; or, with --log, the angles alone, in the order in which the log holds them.
#[derive(Clone, Debug, clap::Args)]
pub struct MultiPosition {
    #[command(flatten)]
    common: Common,
    /// Raw log (packets, or a table of samples) whose stretches at rest are the rows; needs --channels
    #[arg(long, value_name = "FILE", requires = "channels")]
    log: Option<PathBuf>,
    /// Samples a stretch at rest has at least
    #[arg(long, default_value_t = 50)]
    shortest: usize,
}

#[derive(Clone, Debug, clap::Args)]
struct Common {
    /// Table: CSV, tab-separated or LabVIEW, decimal points or commas
    file: PathBuf,
    /// Channels, separated by commas; without it all columns that have NAME_sigma or NAME_n beside them, or else those that
    /// --unit has
    #[arg(long, value_delimiter = ',')]
    channels: Vec<String>,
    /// Nominal unit (unit.toml): axes to tell wiring errors by, ranges to tell saturation by
    #[arg(long, value_name = "FILE")]
    unit: Option<PathBuf>,
    #[command(flatten)]
    table: TableArguments,
    /// Degree of the bias in temperature
    #[arg(long, default_value_t = 0)]
    bias_order: usize,
    /// Degree of the scale in temperature
    #[arg(long, default_value_t = 0)]
    scale_order: usize,
    /// What to do with rows that contradict the data
    #[arg(long, value_enum, default_value = "leave-out")]
    contradicted: Contradicted,
    #[command(flatten)]
    units: Units,
    #[command(flatten)]
    output: Output,
}

impl RateTable {
    pub fn json(&self) -> bool {
        self.common.output.json()
    }
}

impl MultiPosition {
    pub fn json(&self) -> bool {
        self.common.output.json()
    }
}

pub fn rate_table(arguments: &RateTable) -> Result<bool, CalibrateError> {
    let common = &arguments.common;
    let (bytes, nominal) = common.read()?;
    let table = Table::parse(&common.file, &bytes)?;
    let experiment = common.layout(Excitation::Rate, nominal.as_ref(), |layout| {
        Experiment::read(&table, layout)
    })?;
    common.calibrate(&experiment, nominal.as_ref(), Vec::new(), &[(&common.file, &bytes)])
}

pub fn multi_position(arguments: &MultiPosition) -> Result<bool, CalibrateError> {
    let common = &arguments.common;
    let (bytes, nominal) = common.read()?;
    let table = Table::parse(&common.file, &bytes)?;
    let mut sources: Vec<(&Path, &[u8])> = vec![(&common.file, &bytes)];
    let logged;
    let experiment = match &arguments.log {
        None => common.layout(Excitation::Force, nominal.as_ref(), |layout| {
            Experiment::read(&table, layout)
        })?,
        Some(path) => {
            let samples;
            (samples, logged) = log::samples(path, &common.channels)?;
            sources.push((path, &logged));
            let found = stretches::still(&samples, arguments.shortest);
            if found.len() != table.rows.len() {
                return Err(CalibrateError::of(path)(count_differs(&found, table.rows.len())));
            }
            let mean = |number: usize, _: &table::Row| Ok(found[number].mean.iter().map(|mean| Some(*mean)).collect());
            let channels = common.channels.clone();
            common.layout(Excitation::Force, nominal.as_ref(), |layout| {
                Experiment::assemble(&table, layout, channels, &mean)
            })?
        }
    };
    let (mount, site) = (common.table.mount(), common.table.site());
    match lean::lean(&experiment, &mount, &site) {
        Some(lean) => {
            let [a, b] = lean.lean_rad.map(f64::to_degrees);
            let [sa, sb] = lean.sigma_rad.map(f64::to_degrees);
            let remark = format!(
                "the table's outer axis leans by {a:.4} ± {sa:.4} deg, its zero is off by {b:.4} ± {sb:.4} deg (1 sigma); taken out"
            );
            let experiment = lean::leaning(&experiment, &mount, &site, lean.lean_rad);
            common.calibrate(&experiment, nominal.as_ref(), vec![remark], &sources)
        }
        None => {
            let remark =
                "how much the table leans is not seen: that needs table angles, and positions at several inner angles";
            common.calibrate(&experiment, nominal.as_ref(), vec![remark.into()], &sources)
        }
    }
}

fn count_differs(found: &[Stretch], rows: usize) -> String {
    let ends: Vec<String> = found
        .iter()
        .take(100)
        .map(|one| format!("{}..{}", one.from, one.to))
        .collect();
    format!(
        "stands still {} times, and the table of positions has {rows} rows; samples at rest: {}. Change --shortest, or \
         the table",
        found.len(),
        ends.join(" ")
    )
}

impl Common {
    fn read(&self) -> Result<(Vec<u8>, Option<Nominal>), CalibrateError> {
        let nominal = self.unit.as_deref().map(read_nominal).transpose()?;
        Ok((table::bytes(&self.file)?, nominal))
    }

    fn layout<T>(&self, kind: Excitation, nominal: Option<&Nominal>, read: impl FnOnce(&Layout) -> T) -> T {
        let limit = |name: &str| {
            let channel = nominal.and_then(|nominal| nominal.channel(name));
            channel.map_or(f64::INFINITY, NominalChannel::limit_counts)
        };
        let sensor = match kind {
            Excitation::Rate => "gyro",
            Excitation::Force => "accelerometer",
        };
        let has = |name: &str| {
            let channel = nominal.and_then(|nominal| nominal.channel(name));
            channel.is_some_and(|channel| channel.sensor == sensor)
        };
        read(&Layout {
            kind,
            mount: self.table.mount(),
            site: self.table.site(),
            channels: &self.channels,
            has: &has,
            units: self.units,
            limit: &limit,
        })
    }

    fn calibrate(
        &self,
        experiment: &Experiment,
        nominal: Option<&Nominal>,
        remarks: Vec<String>,
        files: &[(&Path, &[u8])],
    ) -> Result<bool, CalibrateError> {
        let fail = CalibrateError::of(&self.file);
        let axes = nominal.map(|nominal| nominal.axes_b(&experiment.channels)).transpose();
        let options = Options {
            orders: Orders {
                bias: self.bias_order,
                scale: self.scale_order,
            },
            contradicted: self.contradicted,
            nominal_b: axes
                .map_err(|name| fail(format!("the unit file has no axis for {name}")))?
                .unwrap_or_default(),
        };
        let found = controlled::calibrate(experiment, &options)?;
        let mut report = describe(experiment, &found, self.contradicted);
        report.remarks.extend(remarks);
        report
            .remarks
            .extend(checks::hidden_drift(&in_order(experiment, &found)));
        report.wrong.extend(held_against(experiment, &found, nominal));
        let entries = Entry::controlled(&found, experiment.kind);
        self.output.finish(&report, entries, files)
    }
}

/// What the nominal unit, the table's own sigmas and the order of the rows say against it.
fn held_against(experiment: &Experiment, found: &Calibration, nominal: Option<&Nominal>) -> Vec<String> {
    let declared: Vec<_> = experiment.declared.into_iter().collect();
    let honest = found.wirings.first().is_none_or(|wiring| wiring.honest());
    let mut wrong = Vec::new();
    for (k, channel) in found.channels.iter().enumerate() {
        let (name, fit) = (&channel.name, &channel.response);
        if let Some(nominal) = nominal.and_then(|nominal| nominal.channel(name)) {
            wrong.extend(checks::scale(
                name,
                fit.counts_per_unit(),
                nominal.lsb.recip(),
                &declared,
            ));
            let axis_b = nominal.axis_b.filter(|_| honest);
            wrong.extend(axis_b.and_then(|axis_b| checks::axis(name, fit.axis_b(), axis_b.into())));
        }
        let rows = rows(experiment, found, k);
        wrong.extend(checks::residuals(name, &rows, rows.len() - fit.freedom));
    }
    wrong
}

/// The rows of a channel's fit, in the order of the table.
fn rows(experiment: &Experiment, found: &Calibration, channel: usize) -> Vec<checks::Row> {
    let (used, fit) = (&found.channels[channel].rows, &found.channels[channel].response);
    let row = |(&row, &residual): (&usize, &f64)| {
        let trial = &experiment.trials[row];
        checks::Row {
            label: format!("row {} (line {})", trial.label, trial.line),
            along: fit.sensitivity_b.dot(&found.excitation_b[row].unwrap_or_default()),
            residual,
            stated: trial.stated.get(channel).copied().flatten(),
        }
    };
    used.iter().zip(&fit.residuals).map(row).collect()
}

/// The channels whose rows are in the order of their excitation.
fn in_order<'a>(experiment: &Experiment, found: &'a Calibration) -> Vec<&'a str> {
    let channels = found.channels.iter().enumerate();
    let ordered = channels.filter(|(k, _)| checks::in_order(&rows(experiment, found, *k)));
    ordered.map(|(_, channel)| channel.name.as_str()).collect()
}

fn describe(experiment: &Experiment, found: &Calibration, contradicted: Contradicted) -> Report {
    let (title, unit) = match experiment.kind {
        Excitation::Rate => ("Rate table", "rad/s"),
        Excitation::Force => ("Multi-position", "m/s²"),
    };
    let columns = [
        "channel",
        "counts per unit",
        "± rel.",
        "axis b",
        "± rad",
        "bias",
        "±",
        "scatter",
        "left out",
        "rows",
    ];
    let mut report = Report {
        title: format!("{title} calibration, {unit}"),
        columns: columns.map(String::from).to_vec(),
        remarks: experiment.remarks.clone(),
        ..Report::default()
    };
    let label = |row: usize| {
        format!(
            "row {} (line {})",
            experiment.trials[row].label, experiment.trials[row].line
        )
    };
    for one in &found.consensus.contradictions {
        let claimed = experiment.trials[one.row].excitation_b;
        let vector = |v: nalgebra::Vector3<f64>| format!("({:.5}, {:.5}, {:.5})", v.x, v.y, v.z);
        let mut line = format!(
            "{} contradicts the data: it claims {} {unit}",
            label(one.row),
            vector(claimed)
        );
        if let Some(found_b) = one.found_b {
            line += &format!(", the channels say {}", vector(found_b));
        }
        if let Some(reading) = one.reading {
            line += &format!(", which is {} of what it claims", reading.words());
        }
        line += match (contradicted, one.reading) {
            (Contradicted::Correct, Some(_)) => "; corrected",
            (Contradicted::Keep, _) => "; kept",
            _ => "; left out",
        };
        report.wrong.push(line);
    }
    for rows in &found.consensus.alternatives {
        let rows: Vec<String> = rows.iter().map(|&row| label(row)).collect();
        report.wrong.push(format!(
            "the data would as well blame {}; only the table's angles can tell",
            rows.join(", ")
        ));
    }
    for &row in &found.disagree {
        let claimed = experiment.trials[row].claimed_b.unwrap_or_default();
        let real = experiment.trials[row].excitation_b;
        let text = format!("{}: written is {claimed:.4?}, its angles give {real:.4?}", label(row));
        report.wrong.push(text.replace('\n', " "));
    }
    if let Some(wiring) = found.wirings.first().filter(|wiring| !wiring.honest()) {
        let names = &experiment.channels;
        let sure = surely_inverted(&found.wirings);
        for k in &sure {
            report.wrong.push(format!("{} is inverted", names[*k]));
        }
        let ways: Vec<String> = found.wirings.iter().map(|wiring| wiring.words(names)).collect();
        report.wrong.push(format!(
            "the channels are not wired as drawn (misfit {:.3}); as good as each other are: {}",
            wiring.misfit,
            ways.join("; or ")
        ));
        report
            .next
            .push("check the plugs and the outputs' polarity, then the signs of the table's axes".into());
    }
    for &(row, earlier) in &found.repeated {
        report.remarks.push(format!(
            "{} repeats {}: it adds no direction",
            label(row),
            label(earlier)
        ));
    }
    if experiment.kind == Excitation::Rate {
        let paired = 2 * found.pairs.len();
        let used = found.excitation_b.iter().flatten().count();
        if paired < used {
            report.remarks.push(format!(
                "{} of {used} runs have no antagonist: drift stays in their scale",
                used - paired
            ));
        }
    }
    let mut pictures = Vec::new();
    for channel in &found.channels {
        let fit = &channel.response;
        let (axis, left_out) = (fit.axis_b(), Calibration::held_out_rms(channel));
        report.rows.push(vec![
            channel.name.clone(),
            format!("{:.6}", fit.counts_per_unit()),
            format!("{:.1e}", fit.scale_sigma()),
            format!("{:+.5} {:+.5} {:+.5}", axis.x, axis.y, axis.z),
            format!("{:.1e}", fit.axis_sigma_rad()),
            format!("{:.6}", fit.bias[0]),
            format!("{:.1e}", fit.bias_sigma()),
            format!("{:.2e}", fit.scatter),
            if left_out.is_finite() {
                format!("{left_out:.2e}")
            } else {
                "-".into()
            },
            channel.rows.len().to_string(),
        ]);
        if fit.freedom == 0 {
            report.wrong.push(format!(
                "{}: as many rows as parameters, nothing checks them",
                channel.name
            ));
        } else if left_out.is_nan() || left_out > CARRIES_OVER * fit.scatter + f64::EPSILON * fit.counts_per_unit() {
            let text = "rows left out are predicted far worse than rows in the fit: add positions";
            report.wrong.push(format!("{}: {text}", channel.name));
        }
        let points = |values: &[f64]| {
            channel
                .rows
                .iter()
                .zip(values)
                .map(|(&row, value)| (row as f64 + 1.0, *value))
                .collect()
        };
        pictures.push(Leftover {
            channel: channel.name.clone(),
            fitted: points(&fit.residuals),
            left_out: points(&channel.held_out),
        });
    }
    report.picture(report::residuals("Residuals", "counts", &pictures));
    if !found.consensus.contradictions.is_empty() {
        report
            .next
            .push("put right the rows named above, and run again; until then do not load this set".into());
    } else if report.wrong.is_empty() {
        report
            .next
            .push("compare with the last set: ground calibration diff".into());
    }
    report
}
