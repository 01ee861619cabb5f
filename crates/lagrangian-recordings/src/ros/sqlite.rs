//! ROS 2 bags in `SQLite` (`.db3`): the tables `topics` and `messages`.

use std::collections::HashMap;
use std::io::{Cursor, Read, Seek};

use rusqlite::config::DbConfig;
use rusqlite::{Connection, MAIN_DB, Row};

use super::{Bag, Message, Topic};
use lagrangian_motion::{Error, Result};

/// The first bytes of every `SQLite` database.
const MAGIC: &[u8; 16] = b"SQLite format 3\0";
/// Bytes of its header.
const HEADER: usize = 100;
/// Largest bag that is read, bytes: `SQLite` holds a database in memory in one block, of at most this size.
const LARGEST: u64 = 0x7fff_fe00;

/// A bag in memory.
pub(super) struct Database {
    connection: Connection,
    topics: Vec<(i64, Topic)>,
}

impl Database {
    /// Reads a bag into memory and checks that it is complete.
    pub(super) fn open(mut source: impl Read + Seek) -> Result<Self> {
        let size = source.seek(std::io::SeekFrom::End(0))?;
        source.rewind()?;
        if size > LARGEST {
            return Err(malformed(
                "it is larger than 2 GB: convert it to MCAP with `ros2 bag convert`, which is read piece by piece",
            ));
        }
        let connection = in_memory(source, size)?;
        refuse_damage(&connection)?;
        refuse_other_databases(&connection)?;
        let topics = rows(
            &connection,
            "SELECT id, name, type, serialization_format FROM topics ORDER BY id",
            |row| {
                let topic = Topic {
                    name: row.get(1)?,
                    kind: row.get(2)?,
                    encoding: row.get(3)?,
                };
                Ok((row.get(0)?, topic))
            },
        )?;
        Ok(Self { connection, topics })
    }
}

impl Bag for Database {
    const FORMAT: &'static str = FORMAT;

    fn visit(
        &mut self,
        wanted: &dyn Fn(&Topic) -> bool,
        take: &mut dyn FnMut(&Topic, Message<'_>) -> Result<()>,
    ) -> Result<Vec<Topic>> {
        // One pass for all topics, whatever their number.
        let order = "SELECT topic_id, timestamp, data FROM messages WHERE topic_id IN (SELECT value FROM json_each(?1)) ORDER BY rowid";
        let mut statement = self.connection.prepare(order).map_err(damaged)?;
        let named = self.topics.iter().filter(|(_, topic)| wanted(topic));
        let topics: HashMap<i64, &Topic> = named.map(|(id, topic)| (*id, topic)).collect();
        let ids: Vec<String> = topics.keys().map(i64::to_string).collect();
        let mut rows = statement
            .query([format!("[{}]", ids.join(","))])
            .map_err(damaged)?;
        while let Some(row) = rows.next().map_err(damaged)? {
            let id: i64 = row.get(0).map_err(damaged)?;
            let message = Message {
                log_time: row.get(1).map_err(damaged)?,
                data: row
                    .get_ref(2)
                    .map_err(damaged)?
                    .as_blob()
                    .map_err(|e| malformed(e.to_string()))?,
            };
            if let Some(topic) = topics.get(&id) {
                take(topic, message)?;
            }
        }
        Ok(self.topics.iter().map(|(_, topic)| topic.clone()).collect())
    }
}

const FORMAT: &str = "ROS 2 bag (SQLite)";

fn malformed(reason: impl Into<String>) -> Error {
    Error::malformed(FORMAT, reason.into())
}

fn damaged(error: rusqlite::Error) -> Error {
    malformed(format!("{error}: copy it again, or record it again"))
}

/// A read-only database of these bytes, whose schema is not trusted.
fn in_memory(mut source: impl Read, size: u64) -> Result<Connection> {
    let mut header = [0; HEADER];
    let mut start = Vec::new();
    source
        .by_ref()
        .take(HEADER as u64)
        .read_to_end(&mut start)?;
    if !start.starts_with(MAGIC) || start.len() < HEADER {
        return Err(malformed("it does not begin as an SQLite database does"));
    }
    header.copy_from_slice(&start);
    refuse_cut(&header, size)?;
    // A database in memory has no write-ahead log: its header is set to that of a database without one.
    header[18] = 1;
    header[19] = 1;
    let mut connection = Connection::open_in_memory().map_err(damaged)?;
    let bytes = usize::try_from(size).map_err(|_| malformed("it does not fit into memory"))?;
    let whole = Cursor::new(header).chain(source);
    connection
        .deserialize_read_exact(MAIN_DB, whole, bytes, true)
        .map_err(damaged)?;
    for (setting, value) in [
        (DbConfig::SQLITE_DBCONFIG_DEFENSIVE, true),
        (DbConfig::SQLITE_DBCONFIG_TRUSTED_SCHEMA, false),
    ] {
        connection.set_db_config(setting, value).map_err(damaged)?;
    }
    Ok(connection)
}

/// Refuses a file shorter than the pages that its header counts.
fn refuse_cut(header: &[u8; HEADER], size: u64) -> Result<()> {
    let number = |at: usize| {
        u32::from_be_bytes([header[at], header[at + 1], header[at + 2], header[at + 3]])
    };
    let page = match u16::from_be_bytes([header[16], header[17]]) {
        1 => 65_536,
        page => u64::from(page),
    };
    // The count is valid only if the change counter equals that of the last writer that set it.
    let counted = number(24) == number(92);
    let expected = u64::from(number(28)) * page;
    match counted && size < expected {
        true => Err(malformed(format!(
            "it is cut off after {size} of {expected} bytes: copy it again"
        ))),
        false => Ok(()),
    }
}

fn refuse_damage(connection: &Connection) -> Result<()> {
    let findings = rows(connection, "PRAGMA integrity_check(1)", |row| {
        row.get::<_, String>(0)
    })?;
    match findings.first().map(String::as_str) {
        Some("ok") => Ok(()),
        Some(finding) => {
            let finding = finding.replace('\n', " ");
            Err(malformed(format!(
                "it is damaged ({finding}): copy it again, or record it again"
            )))
        }
        None => Err(malformed("SQLite cannot say whether it is whole")),
    }
}

/// Refuses a database that is not a bag: without the two tables, or with other objects of these names.
fn refuse_other_databases(connection: &Connection) -> Result<()> {
    let query = "SELECT name FROM sqlite_schema WHERE type = 'table' AND sql NOT LIKE 'CREATE VIRTUAL%' ORDER BY name";
    let tables = rows(connection, query, |row| row.get::<_, String>(0))?;
    for needed in ["messages", "topics"] {
        if !tables.iter().any(|table| table == needed) {
            let found = match tables.is_empty() {
                true => "none".into(),
                false => tables.join(", "),
            };
            return Err(malformed(format!(
                "it is an SQLite database without the table '{needed}' of a bag (tables found: {found})"
            )));
        }
    }
    let lost = "SELECT count(*) FROM messages WHERE topic_id IS NULL OR topic_id NOT IN (SELECT id FROM topics)";
    match rows(connection, lost, |row| row.get::<_, i64>(0))?.first() {
        Some(0) => Ok(()),
        lost => {
            let lost = lost.copied().unwrap_or_default();
            Err(malformed(format!(
                "{lost} of its messages belong to no topic: copy it again"
            )))
        }
    }
}

/// The results of `of` for the rows of a query.
fn rows<T>(
    connection: &Connection,
    query: &str,
    of: impl FnMut(&Row<'_>) -> rusqlite::Result<T>,
) -> Result<Vec<T>> {
    let mut statement = connection.prepare(query).map_err(damaged)?;
    let rows = statement.query_map([], of).map_err(damaged)?;
    rows.collect::<rusqlite::Result<_>>().map_err(damaged)
}
