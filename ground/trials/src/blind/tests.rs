use super::*;

#[test]
fn what_was_changed_after_its_hash_was_published_is_found() {
    let place = tempfile::tempdir().expect("a folder");
    let (folder, answers) = (place.path().join("cases"), place.path().join("answers"));
    let hand = Hand {
        r0: 1,
        ..Hand::default()
    };
    make(&folder).expect("a folder");
    deal(&folder, &answers, hand, Vec::new(), 1).expect("dealt");
    commit(&folder, &answers).expect("committed");
    assert!(matches!(reveal(&folder, &answers), Err(BlindError::Unanswered(_))));
    let verdict = folder.join("T001").join(VERDICT);
    fs::write(&verdict, r#"{"causes":[],"none_of_these":0.0}"#).expect("written");
    let half: Part = "1/2".parse().expect("a part");
    assert_eq!(answer(&folder, half).expect("answered").1, 1);
    assert!(
        matches!(reveal(&folder, &answers), Err(BlindError::Unanswered(path)) if path.ends_with("answered-2-of-2.json"))
    );
    assert_eq!(answer(&folder, "2/2".parse().expect("a part")).expect("answered").1, 0);
    reveal(&folder, &answers).expect("revealed");
    assert!(matches!(answer(&folder, half), Err(BlindError::Revealed(_))));
    let judged = judged(&folder).expect("scored");
    assert_eq!(judged.len(), 1);
    let baseline = folder.join("T001").join("verdict-lasso.json");
    fs::write(baseline, r#"{"causes":[{"effect":"gyro-bias","probability":1.0}]}"#).expect("written");
    let tools = tools(&folder, &judged).expect("read");
    let value = |tool: usize| {
        let lines = &tools[tool].1;
        lines
            .iter()
            .find(|line| line.what == "false name, nothing wrong")
            .map(|line| line.value)
    };
    assert_eq!(
        (tools[1].0.as_str(), value(0), value(1)),
        ("lasso", Some(0.0), Some(1.0))
    );

    fs::write(&verdict, r#"{"causes":[],"none_of_these":0.1}"#).expect("written");
    assert!(matches!(
        super::judged(&folder),
        Err(BlindError::Changed { manifest: ANSWERED, .. })
    ));
    let kept = answers.join("T001.json");
    let other = fs::read_to_string(&kept).expect("kept").replace("\"R0\"", "\"R1\"");
    fs::write(&kept, other).expect("written");
    assert!(matches!(
        reveal(&folder, &answers),
        Err(BlindError::Changed { manifest: MANIFEST, .. })
    ));
}
