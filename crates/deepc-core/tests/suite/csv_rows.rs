//! How the rows of a file become samples.

use deepc_core::data::{Dataset, OutputTiming};

#[test]
fn inputs_are_paired_with_the_outputs_of_the_next_row_where_a_log_says_so() {
    let text = "time_s,u,v,y,z\n0,1,10,100,1000\n1,2,20,200,2000\n2,3,30,300,3000\n";
    let mut data = Dataset::new(1.0, ["u", "v"], ["y", "z"]).unwrap();
    let start = OutputTiming::StartOfInterval;
    data.push_csv(text.as_bytes(), "log.csv", Some("time_s"), start)
        .unwrap();
    let record = &data.records()[0];
    assert_eq!(record.inputs(), faer::mat![[1.0, 10.0], [2.0, 20.0]]);
    assert_eq!(
        record.outputs(),
        faer::mat![[200.0, 2000.0], [300.0, 3000.0]]
    );

    let broken = text.replace("2000", "NaN");
    let message = data
        .push_csv(broken.as_bytes(), "log.csv", Some("time_s"), start)
        .unwrap_err();
    let message = message.to_string();
    assert!(
        message.contains("`z` is NaN at sample 0 (line 3)"),
        "{message}"
    );

    let one_row = "time_s,u,v,y,z\n0,1,10,100,1000\n";
    let message = data
        .push_csv(one_row.as_bytes(), "log.csv", Some("time_s"), start)
        .unwrap_err();
    assert!(message.to_string().contains("no samples"), "{message}");
}

#[test]
fn a_file_without_a_time_column_is_read_row_by_row() {
    let end = OutputTiming::EndOfInterval;
    let text = "u,v,y,z\n1,10,100,1000\n2,20,200,2000\n";
    let mut data = Dataset::new(0.5, ["u", "v"], ["y", "z"]).unwrap();
    data.push_csv(text.as_bytes(), "log.csv", None, end)
        .unwrap();
    let inputs = data.records()[0].inputs();
    assert_eq!(inputs, faer::mat![[1.0, 10.0], [2.0, 20.0]]);
    let broken = "u,v,y,z\n1,10,100,1000\n2,20,inf,2000\n";
    let error = data.push_csv(broken.as_bytes(), "log.csv", None, end);
    let message = error.unwrap_err().to_string();
    assert!(
        message.contains("`y` is inf at sample 1 (line 3)"),
        "{message}"
    );
}
