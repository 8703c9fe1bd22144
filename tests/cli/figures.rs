//! Figures and reports, where there is a Python that draws them.

use crate::test_directory::TestDirectory;

#[test]
fn figures_and_a_report_are_drawn_far_from_the_scripts() {
    let test_directory = TestDirectory::new();
    test_directory.run(&["--set", "output.every=5"]);
    let drawn = test_directory.say(&["figures", "out/scene", "--time", "0.45", "--format", "svg"]);
    if drawn.err.contains("apt install python3-matplotlib") {
        return;
    }
    assert_eq!(drawn.code, Some(0), "{drawn:?}");
    for picture in ["setting_t0.5.svg", "deformed_t0.5.svg", "pressure_t0.5.svg"] {
        assert!(test_directory.read(&format!("out/scene/{picture}")).contains("<svg"), "{picture}");
    }
    assert_eq!(test_directory.say(&["figures", "nothing"]).code, Some(2));

    assert_eq!(test_directory.say(&["report", "out/scene"]).code, Some(0));
    let page = test_directory.read("out/scene/report.html");
    assert!(page.contains("data:image/png;base64,") && page.contains("[[boundary]]"));
    let outside = ["src=\"http", "href=", "<link", "@import", "$title"];
    assert!(outside.iter().all(|word| !page.contains(word)), "the page is not whole");
}
