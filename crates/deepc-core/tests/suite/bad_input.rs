//! What the messages say when the data or settings are wrong.

use crate::common;
use deepc_core::data::{CsvLayout, DataError, Dataset, OutputTiming};
use deepc_core::hankel::{HankelError, HankelMatrix, Horizons};
use deepc_core::predictor::Predictor;
use deepc_core::program::{
    Bounds, CondensedProgram, DeepcSettings, Moment, OutputBounds, PredictiveProgram,
    ProgramOptions, Regularisation, Slack,
};
use faer::{Mat, mat};

fn layout() -> CsvLayout {
    CsvLayout {
        time: Some("time_s".into()),
        inputs: vec!["valve".into(), "heater".into()],
        disturbances: Vec::new(),
        outputs: vec!["level".into(), "temperature".into()],
        outputs_measured: OutputTiming::EndOfInterval,
        sample_time_s: 0.1,
    }
}

fn read(text: &str) -> Result<Dataset, DataError> {
    let layout = layout();
    let mut data = Dataset::new(layout.sample_time_s, &layout.inputs, &layout.outputs)?;
    data.push_csv(
        text.as_bytes(),
        "run.csv",
        layout.time.as_deref(),
        layout.outputs_measured,
    )?;
    Ok(data)
}

#[track_caller]
fn says<T: std::fmt::Debug, E: std::fmt::Display>(result: Result<T, E>, parts: &[&str]) {
    let message = match result {
        Ok(value) => panic!("accepted: {value:?}"),
        Err(error) => error.to_string(),
    };
    for part in parts {
        assert!(message.contains(part), "`{part}` is not in: {message}");
    }
}

const HEADER: &str = "time_s,valve,heater,level,temperature\n";

fn rows(count: usize) -> String {
    let row = |k: usize| format!("{},{k},1.5,{},20\n", 0.1 * k as f64, 2 * k);
    std::iter::once(HEADER.to_owned())
        .chain((0..count).map(row))
        .collect()
}

#[test]
fn columns_are_found_by_name_in_any_order_among_others() {
    let text = "note,level,heater,time_s,temperature,valve\na,1,2,5.0,3,4\nb,5,6,5.1,7,8\n";
    let data = read(text).unwrap();
    let record = &data.records()[0];
    assert_eq!(record.inputs(), mat![[4.0, 2.0], [8.0, 6.0]]);
    assert_eq!(record.outputs(), mat![[1.0, 3.0], [5.0, 7.0]]);
}

#[test]
fn what_is_written_is_read_back_bit_by_bit() {
    let folder = tempfile::tempdir().unwrap();
    let (inputs, outputs) = common::coloured_recording(50, 3);
    let mut data = Dataset::new(0.01, ["valve", "heater"], ["level"]).unwrap();
    data.push_record(inputs.clone(), outputs.clone()).unwrap();
    data.push_record(outputs_twice(&outputs), outputs.clone())
        .unwrap();
    let files = [folder.path().join("a.csv"), folder.path().join("b.csv")];
    for (i, file) in files.iter().enumerate() {
        data.write_csv(i + 1, file, "t").unwrap();
    }
    let layout = CsvLayout {
        time: Some("t".into()),
        inputs: vec!["valve".into(), "heater".into()],
        disturbances: Vec::new(),
        outputs: vec!["level".into()],
        outputs_measured: OutputTiming::EndOfInterval,
        sample_time_s: 0.01,
    };
    let back = Dataset::read_csv(&layout, &files).unwrap();
    assert_eq!(back.records().len(), 2);
    assert_eq!(back.records()[0].inputs(), inputs);
    assert_eq!(back.records()[1].outputs(), outputs);
    says(
        data.write_csv(3, folder.path().join("c.csv"), "t"),
        &["record 3", "has 2"],
    );
}

fn outputs_twice(outputs: &Mat<f64>) -> Mat<f64> {
    Mat::from_fn(outputs.nrows(), 2, |k, i| {
        outputs[(k, 0)] * (1.0 + i as f64)
    })
}

#[test]
fn nan_is_reported_with_channel_sample_line_and_record() {
    let mut data = read(&rows(5)).unwrap();
    let bad = rows(5).replace("0.30000000000000004,3,1.5,6,20", "0.3,3,1.5,NaN,20");
    says(
        data.push_csv(
            bad.as_bytes(),
            "second.csv",
            Some("time_s"),
            OutputTiming::EndOfInterval,
        ),
        &[
            "channel `level` is NaN at sample 3 (line 5) of record 2",
            "second.csv",
            "repair or cut",
        ],
    );
    assert_eq!(data.records().len(), 1);
    let infinite = rows(3).replace(",1.5,", ",inf,");
    says(
        read(&infinite),
        &["channel `heater` is inf at sample 0 (line 2) of record 1"],
    );
    let mut memory = Dataset::new(0.1, ["valve"], ["level"]).unwrap();
    says(
        memory.push_record(mat![[1.0], [f64::NAN]], mat![[0.0], [0.0]]),
        &["channel `valve` is NaN at sample 1 of record 1; repair or cut the record"],
    );
}

#[test]
fn a_missing_column_is_reported_with_those_found() {
    let text = rows(3).replace("heater", "fan");
    says(
        read(&text),
        &[
            "`run.csv` has no column `heater`",
            "\"fan\"",
            "\"valve\"",
            "commas",
        ],
    );
}

#[test]
fn a_repeated_column_is_reported() {
    let text = rows(3).replace("temperature", "level");
    says(read(&text), &["column `level` more than once"]);
}

#[test]
fn a_field_that_is_no_number_is_reported_with_its_place() {
    let text = rows(4).replace(",2,1.5", ",2,warm");
    says(
        read(&text),
        &["line 4", "column `heater`", "`warm` is not a number"],
    );
    says(
        read(&rows(4).replace(",2,1.5", ",2,")),
        &["line 4", "column `heater`", "`` is not"],
    );
}

#[test]
fn uneven_time_stamps_are_reported_with_expected_and_found() {
    let gap = format!("{HEADER}0,1,1,1,1\n0.1,1,1,1,1\n0.3,1,1,1,1\n");
    says(
        read(&gap),
        &[
            "line 4",
            "time is 0.3 s",
            "expected 0.2 s",
            "sample time of 0.1 s",
        ],
    );
    let repeated = format!("{HEADER}0,1,1,1,1\n0,1,1,1,1\n");
    says(
        read(&repeated),
        &["line 3", "time is 0 s", "expected 0.1 s"],
    );
    let unsorted = format!("{HEADER}1,1,1,1,1\n0.9,1,1,1,1\n");
    says(read(&unsorted), &["line 3", "expected 1.1 s", "sort"]);
    let nan = format!("{HEADER}nan,1,1,1,1\n");
    says(read(&nan), &["`time_s` is NaN"]);
    let rounded = format!("{HEADER}0,1,1,1,1\n0.1004,1,1,1,1\n0.1997,1,1,1,1\n");
    assert!(read(&rounded).is_ok());
}

#[test]
fn files_without_samples_are_reported() {
    says(read(""), &["`run.csv` is empty", "header"]);
    says(read(HEADER), &["has a header line but no samples"]);
    says(
        read(&format!("{HEADER}0,1,1\n")),
        &["not a readable comma-separated file"],
    );
    let missing = Dataset::read_csv(&layout(), &["no/such/file.csv"]);
    says(missing, &["cannot open `no/such/file.csv`"]);
}

#[test]
fn records_that_do_not_fit_are_reported_with_counts() {
    let mut data = Dataset::new(0.1, ["a", "b"], ["y"]).unwrap();
    says(
        data.push_record(Mat::zeros(4, 3), Mat::zeros(4, 1)),
        &["record 1 has 3 input columns, expected 2", "rows are time"],
    );
    says(
        data.push_record(Mat::zeros(4, 2), Mat::zeros(5, 1)),
        &["4 input samples and 5 output samples"],
    );
    says(
        data.push_record(Mat::zeros(0, 2), Mat::zeros(0, 1)),
        &["record 1 has no samples"],
    );
    says(
        data.push_rows(&[0.0; 5], &[0.0; 2]),
        &["5 input values", "2 channels"],
    );
    let other = Dataset::new(0.2, ["a", "b"], ["y"]).unwrap();
    says(data.append(other), &["expected 0.1 s, found 0.2 s"]);
    let other = Dataset::new(0.1, ["b", "a"], ["y"]).unwrap();
    says(
        data.append(other),
        &["input channels differ", "[\"b\", \"a\"]"],
    );
}

#[test]
fn names_and_sample_times_are_checked() {
    says(Dataset::new(0.0, ["a"], ["y"]), &["sample time is 0 s"]);
    says(
        Dataset::new(f64::NAN, ["a"], ["y"]),
        &["sample time is NaN s"],
    );
    says(Dataset::new(0.1, ["a"], ["a"]), &["`a` is used twice"]);
    says(
        Dataset::new(0.1, [""], ["y"]),
        &["input channel 0", "empty name"],
    );
    says(
        Dataset::new(0.1, Vec::<String>::new(), vec!["y"]),
        &["no input channel"],
    );
}

const HORIZONS: Horizons = Horizons { past: 4, future: 6 };

fn exciting_error(inputs: Mat<f64>) -> HankelError {
    let outputs = Mat::from_fn(inputs.nrows(), 2, |k, i| inputs[(k, i)] + (k as f64).cos());
    let mut data = Dataset::new(0.1, ["valve", "heater"], ["level", "flow"]).unwrap();
    data.push_record(inputs, outputs).unwrap();
    let hankel = HankelMatrix::build(&data, HORIZONS).unwrap();
    hankel.require_persistently_exciting(3).unwrap_err()
}

#[test]
fn too_few_samples_are_reported_with_given_and_needed() {
    let inputs = common::gaussian(30, 2, &mut common::rng(1));
    let error = exciting_error(inputs);
    assert!(matches!(
        &error,
        HankelError::TooFewSamples(report)
            if (report.samples, report.samples_needed) == (30, 38)
    ));
    says(
        Err::<(), _>(error),
        &["too few samples: 30", "at least 38", "(m+1)(L+n) − 1"],
    );
    let mut data = Dataset::new(0.1, ["valve"], ["level"]).unwrap();
    data.push_record(Mat::zeros(9, 1), Mat::zeros(9, 1))
        .unwrap();
    let short = HankelMatrix::build(&data, HORIZONS);
    says(
        short.map(|_| ()),
        &[
            "record 1 has 9 samples",
            "past + future = 10",
            "at least 19",
        ],
    );
}

#[test]
fn a_constant_input_is_reported_with_ranks_channel_and_remedy() {
    let mut inputs = common::gaussian(100, 2, &mut common::rng(1));
    inputs.col_mut(1).fill(100.0);
    says(
        Err::<(), _>(exciting_error(inputs)),
        &[
            "not persistently exciting",
            "rank 14, needed 26",
            "channel `heater` is constant at 100",
            "add white noise or a PRBS to `heater`",
            "at least 38 samples",
        ],
    );
}

#[test]
fn a_poor_input_is_reported_with_its_own_rank() {
    let mut inputs = common::gaussian(100, 2, &mut common::rng(1));
    for k in 0..100 {
        inputs[(k, 0)] = (0.3 * k as f64).sin();
    }
    says(
        Err::<(), _>(exciting_error(inputs)),
        &["rank 15", "`valve` alone has rank 2 of 13"],
    );
}

#[test]
fn inputs_that_move_together_are_reported_as_such() {
    let mut inputs = common::gaussian(100, 2, &mut common::rng(1));
    for k in 0..100 {
        inputs[(k, 1)] = 5.0 * inputs[(k, 0)];
    }
    let parts = [
        "rank 13, needed 26",
        "move together",
        "independent",
        "`valve`, `heater`",
    ];
    says(Err::<(), _>(exciting_error(inputs)), &parts);
}

#[test]
fn poor_data_are_measured_without_complaint_and_may_be_assumed_good() {
    let mut data = Dataset::new(0.1, ["valve"], ["level"]).unwrap();
    data.push_record(Mat::zeros(20, 1), Mat::zeros(20, 1))
        .unwrap();
    let hankel = HankelMatrix::build(&data, HORIZONS).unwrap();
    let report = hankel.excitation(100).unwrap();
    assert_eq!((report.columns, report.input_rank), (0, 0));
    let report = hankel.excitation(2).unwrap();
    assert_eq!((report.input_rank, report.stacked_rank), (0, 0));
    let text = report.to_string();
    assert!(text.contains("NOT persistently exciting"), "{text}");
    assert!(text.contains("input `valve` is constant at 0"), "{text}");
    let json = serde_json::to_string(&report).unwrap();
    assert_eq!(
        serde_json::from_str::<deepc_core::hankel::ExcitationReport>(&json).unwrap(),
        report
    );
    let assumed = hankel.assume_persistently_exciting();
    assert!(assumed.report().is_none());
    assert_eq!(Predictor::exact(&assumed).unwrap().stacked().ncols(), 1);
    says(
        Predictor::truncated(&assumed, 12).map(|_| ()),
        &["rank 12", "1 to 11"],
    );
}

fn settings() -> DeepcSettings {
    DeepcSettings {
        input_weights: vec![1.0, 1.0],
        output_weights: vec![1.0, 1.0],
        regularisation: Regularisation::raw(1.0),
        input_slack: Slack::Hard,
        output_slack: Slack::Penalty(1e4),
        input_bounds: vec![Bounds::between(-1.0, 1.0); 2],
        output_bounds: vec![OutputBounds::soft(-1.0, 1.0, 1.0, 1.0); 2],
        options: ProgramOptions::default(),
    }
}

#[test]
fn settings_out_of_range_are_reported_by_field() {
    settings().check(2, 2, 5).unwrap();
    let check = |change: &dyn Fn(&mut DeepcSettings), parts: &[&str]| {
        let mut changed = settings();
        change(&mut changed);
        says(changed.check(2, 2, 5), parts);
    };
    check(
        &|s| s.input_weights = vec![1.0],
        &["`input_weights` has 1 entries, expected 2"],
    );
    check(
        &|s| s.output_weights[1] = -2.0,
        &["`output_weights[1]` is -2"],
    );
    check(
        &|s| s.regularisation.lambda_g = 0.0,
        &["`regularisation.lambda_g` is 0"],
    );
    check(
        &|s| s.output_slack = Slack::Penalty(f64::INFINITY),
        &["`output_slack`", "`hard`"],
    );
    check(
        &|s| s.input_bounds[1] = Bounds::between(2.0, 1.0),
        &["`input_bounds[1]` is 2 to 1"],
    );
    check(
        &|s| s.output_bounds[0] = OutputBounds::soft(0.0, 1.0, 0.0, 0.0),
        &["linear 0"],
    );
    check(
        &|s| s.output_bounds[0] = OutputBounds::hard(f64::NAN, 1.0),
        &["`output_bounds[0]`"],
    );
}

#[test]
fn settings_refuse_unknown_fields_and_survive_a_round_trip() {
    let json = serde_json::to_string(&settings()).unwrap();
    assert_eq!(
        serde_json::from_str::<DeepcSettings>(&json).unwrap(),
        settings()
    );
    let unknown = json.replacen("input_weights", "input_weight", 1);
    says(
        serde_json::from_str::<DeepcSettings>(&unknown),
        &["unknown field `input_weight`"],
    );
}

#[test]
fn a_moment_of_the_wrong_shape_is_refused_with_its_name() {
    let data = common::dataset(vec![common::record(
        &common::Lti::random(2, 2, 2, 0.8, 1),
        100,
        0.01,
        1,
    )]);
    let predictor = Predictor::full(&common::exciting(&data, 4, 6, 2));
    let mut program = CondensedProgram::new(&predictor, &settings()).unwrap();
    let (past, future, wrong) = (
        Mat::zeros(4, 2),
        Mat::<f64>::zeros(6, 2),
        Mat::<f64>::zeros(2, 4),
    );
    let moment = Moment {
        past_inputs: past.as_ref(),
        past_outputs: wrong.as_ref(),
        input_reference: future.as_ref(),
        output_reference: future.as_ref(),
        disturbances: None,
    };
    says(
        program.set_moment(&moment),
        &["the past of the outputs is 2×4, expected 4×2"],
    );
}

#[test]
fn absurd_sizes_are_refused_and_do_not_overflow() {
    let mut data = Dataset::new(1.0, ["u"], ["y"]).unwrap();
    data.push_rows(&[1.0, -1.0, 2.0, 0.5], &[0.0, 1.0, 2.0, 3.0])
        .unwrap();
    let message = HankelMatrix::build(&data, Horizons::new(usize::MAX, 1)).unwrap_err();
    assert!(message.to_string().contains("4 samples"), "{message}");
    let hankel = HankelMatrix::build(&data, Horizons::new(1, 1)).unwrap();
    let message = hankel
        .require_persistently_exciting(usize::MAX / 2)
        .unwrap_err();
    assert!(
        message.to_string().contains("too few samples: 4"),
        "{message}"
    );
}
