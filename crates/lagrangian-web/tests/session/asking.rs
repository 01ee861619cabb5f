//! Helpers for requests of tests.

use lagrangian_web::{Message, Session};
use serde_json::{Value, json};

/// The answer to a request of the page.
pub(crate) fn ask(session: &mut Session, request: &Value) -> Value {
    let answer = session.answer(&Message::text(&request.to_string()));
    serde_json::from_str(&answer.unwrap().text).unwrap()
}

/// The bytes of a file that the page requests.
pub(crate) fn file(session: &mut Session, what: &str) -> Vec<u8> {
    let request = json!({ "ask": what }).to_string();
    session.answer(&Message::text(&request)).unwrap().bytes
}

/// The message of a refused request.
pub(crate) fn refused(session: &mut Session, request: &Value) -> String {
    let answer = session.answer(&Message::text(&request.to_string()));
    answer.unwrap_err().to_string()
}

/// The answer to a request with a file, or the reason for its refusal.
pub(crate) fn give(session: &mut Session, request: &Value, bytes: &[u8]) -> Result<Value, String> {
    let message = Message {
        text: request.to_string(),
        bytes: bytes.to_vec(),
    };
    let answer = session.answer(&message).map_err(|e| e.to_string())?;
    Ok(serde_json::from_str(&answer.text).unwrap())
}

/// Continues a fit in slices of this length to its end; returns the number of slices.
pub(crate) fn advance(session: &mut Session, milliseconds: f64) -> usize {
    let request = json!({ "ask": "advance", "milliseconds": milliseconds });
    let mut slices = 1;
    while ask(session, &request)["done"] == json!(false) {
        slices += 1;
    }
    slices
}
