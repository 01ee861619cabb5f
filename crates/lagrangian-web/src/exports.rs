//! Exports of the WebAssembly module to the page: a buffer for a message, and its answer.
//!
//! A message is four bytes (the length of its text, little endian), the text in UTF-8, and the bytes of a file if there is
//! one; an answer has the same form. The page writes a message to the address from [`lagrangian_input`], calls [`lagrangian_answer`], and
//! copies the answer from [`lagrangian_output`]. All memory stays on this side, so that nothing here needs `unsafe` code.

use std::cell::RefCell;

use serde_json::json;

use crate::error::{Error, Result};
use crate::session::{Message, Session};

/// The state between two calls.
#[derive(Default)]
struct Kept {
    session: Session,
    input: Vec<u8>,
    output: Vec<u8>,
}

thread_local! {
    static KEPT: RefCell<Kept> = RefCell::default();
    static FAILURE: RefCell<String> = const { RefCell::new(String::new()) };
}

/// Allocates space for a message of `length` bytes, and returns its address.
#[cfg_attr(target_family = "wasm", unsafe(no_mangle))]
pub extern "C" fn lagrangian_input(length: usize) -> *mut u8 {
    KEPT.with_borrow_mut(|kept| {
        kept.input.clear();
        kept.input.resize(length, 0);
        kept.input.as_mut_ptr()
    })
}

/// Answers the message, and returns the length of the answer.
#[cfg_attr(target_family = "wasm", unsafe(no_mangle))]
pub extern "C" fn lagrangian_answer() -> usize {
    KEPT.with_borrow_mut(|kept| {
        let input = std::mem::take(&mut kept.input);
        kept.output = reply(&mut kept.session, &input);
        kept.output.len()
    })
}

/// The address of the answer.
#[cfg_attr(target_family = "wasm", unsafe(no_mangle))]
pub extern "C" fn lagrangian_output() -> *const u8 {
    KEPT.with_borrow(|kept| kept.output.as_ptr())
}

/// Installs a hook that keeps the message of a panic, which ends this module.
#[cfg_attr(target_family = "wasm", unsafe(no_mangle))]
pub extern "C" fn lagrangian_begin() {
    std::panic::set_hook(Box::new(|info| {
        FAILURE.with_borrow_mut(|failure| *failure = info.to_string());
    }));
}

/// The address of that message.
#[cfg_attr(target_family = "wasm", unsafe(no_mangle))]
pub extern "C" fn lagrangian_failure() -> *const u8 {
    FAILURE.with_borrow(|failure| failure.as_ptr())
}

/// The length of that message, bytes.
#[cfg_attr(target_family = "wasm", unsafe(no_mangle))]
pub extern "C" fn lagrangian_failure_length() -> usize {
    FAILURE.with_borrow(String::len)
}

/// The answer to a message in bytes: `{"ok": …}`, or `{"error": "what happened, and what to do"}`.
pub fn reply(session: &mut Session, message: &[u8]) -> Vec<u8> {
    match parsed(message).and_then(|message| session.answer(&message)) {
        Ok(Message { text, bytes }) => framed(&format!("{{\"ok\":{text}}}"), &bytes),
        Err(error) => framed(&json!({ "error": error.to_string() }).to_string(), &[]),
    }
}

fn parsed(message: &[u8]) -> Result<Message> {
    let (length, rest) = message.split_first_chunk::<4>().ok_or(Error::Incomplete)?;
    let length = u32::from_le_bytes(*length) as usize;
    let (text, bytes) = rest.split_at_checked(length).ok_or(Error::Incomplete)?;
    let text = std::str::from_utf8(text).map_err(|_| Error::Incomplete)?;
    Ok(Message {
        text: text.into(),
        bytes: bytes.to_vec(),
    })
}

fn framed(text: &str, bytes: &[u8]) -> Vec<u8> {
    // OK because answers are far below four gigabytes: motions and models are bounded.
    let length = u32::try_from(text.len()).unwrap_or(u32::MAX);
    [&length.to_le_bytes(), text.as_bytes(), bytes].concat()
}
