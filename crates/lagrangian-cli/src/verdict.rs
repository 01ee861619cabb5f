//! The reliability of a model, in words and as an exit code.

use std::fmt::Write;

use lagrangian::score::{Assessment, Forward, Grade};

use crate::failure::{FAILED, SUCCESS, with_flags};

/// The verdict and its reasons, for a terminal.
pub(crate) fn text(assessment: &Assessment) -> String {
    let mut text = format!("verdict: {}\n", assessment.verdict.name());
    // OK: writing to a string does not fail.
    let expected = &assessment.expectation;
    let said = assessment.reasons.iter().any(|r| r.finding == *expected);
    if !said && !expected.is_empty() {
        let _ = writeln!(text, "  {expected}");
    }
    for reason in &assessment.reasons {
        let remedy = with_flags(&reason.remedy);
        let _ = writeln!(text, "  {}; {remedy}", reason.finding);
    }
    let lost = unpredictable(assessment);
    if !lost.is_empty() {
        let _ = writeln!(
            text,
            "  not predictable forwards, as inertia is less of the torque than what stays unexplained: {}",
            lost.join(", ")
        );
    }
    text
}

/// The names of the coordinates whose acceleration cannot be predicted from the torques.
pub(crate) fn unpredictable(assessment: &Assessment) -> Vec<&str> {
    let joints = assessment.joints.iter().filter(|j| !j.predictable);
    joints.map(|Forward { name, .. }| name.as_str()).collect()
}

/// Success, except for a model that must not be used.
pub(crate) fn exit_code(assessment: &Assessment) -> u8 {
    match assessment.verdict {
        Grade::Good | Grade::Fair => SUCCESS,
        Grade::Poor => FAILED,
    }
}
