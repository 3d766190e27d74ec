//! Rows on disk as they are gathered, so that a solve that was cut off goes on from there.
//!
//! The solve is a function of scene and settings alone, and rays are nearly all of its work: done again with the rows
//! read from the journal it comes to the same bytes. A record that was cut short or altered ends what is read, and
//! is gathered again.

use crate::bytes::{Plain, Reader, put_all, record};
use crate::transport::{Landing, Row};
use half::f16;
use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// A file of rows in the order in which they are gathered.
#[derive(Debug)]
pub struct Journal {
    path: PathBuf,
    /// The job that records are of.
    key: [u8; 32],
    /// What was written before, as long as it lasts.
    old: Option<BufReader<File>>,
    /// Where new records go.
    new: Option<File>,
    /// Bytes that are known to be good.
    good: u64,
    /// Records so far.
    records: u64,
    /// Rows that did not have to be gathered.
    recalled: usize,
    failure: Option<io::Error>,
}

/// Key of the job, then records: number of bytes, BLAKE3 of key and number and bytes, bytes.
const HEAD: u64 = 32;
/// No record is longer: a length that was altered may not ask for all memory.
const LONGEST: u64 = 1 << 32;

impl Journal {
    /// A journal in the file `path`, which need not exist.
    pub fn at(path: &Path) -> Journal {
        Journal {
            path: path.into(),
            key: [0; 32],
            old: None,
            new: None,
            good: 0,
            records: 0,
            recalled: 0,
            failure: None,
        }
    }

    /// Rows that were read instead of gathered.
    pub fn recalled(&self) -> usize {
        self.recalled
    }

    /// Why nothing more is written, if so; the solve itself goes on.
    pub fn failure(&self) -> Option<&io::Error> {
        self.failure.as_ref()
    }

    /// The work is done: the file goes.
    pub fn remove(self) {
        if self.new.is_none() {
            return; // it may be another's
        }
        // What is left over is found and overwritten by the next solve of that name.
        let _ = std::fs::remove_file(&self.path);
    }

    /// Opens the file for the job that `key` stands for; what another job left there is dropped.
    pub(crate) fn begin(&mut self, key: &[u8; 32]) {
        let open = || -> io::Result<(Option<BufReader<File>>, File)> {
            let mut new =
                File::options().read(true).write(true).create(true).truncate(false).open(&self.path)?;
            // Two solves of one name would write into one another's records.
            new.try_lock().map_err(|_| io::Error::other("another solve is at work on it"))?;
            let mut head = [0; HEAD as usize];
            if new.read_exact(&mut head).is_ok() && head == *key {
                return Ok((Some(BufReader::new(File::open(&self.path)?)), new));
            }
            new.set_len(0)?;
            new.seek(SeekFrom::Start(0))?;
            new.write_all(key)?;
            Ok((None, new))
        };
        (self.key, self.good, self.records) = (*key, HEAD, 0);
        match open() {
            Ok((old, new)) => (self.old, self.new) = (old, Some(new)),
            Err(e) => self.failure = Some(e),
        }
        let skipped = self.old.as_mut().map(|old| old.seek(SeekFrom::Start(HEAD)));
        if let Some(Err(e)) = skipped {
            (self.old, self.failure) = (None, Some(e));
        }
    }

    /// The rows of the next record, if it was written before.
    pub(crate) fn recall(&mut self, count: usize) -> Option<Vec<Row>> {
        let rows = self.old.as_mut().and_then(|old| {
            let mut head = [0; 40];
            old.read_exact(&mut head).ok()?;
            let length = u64::get(&head).min(LONGEST);
            let mut bytes = Vec::new();
            old.take(length).read_to_end(&mut bytes).ok()?;
            let whole =
                bytes.len() as u64 == length && checksum(&self.key, self.records, &bytes) == head[8..];
            whole.then(|| get_rows(&bytes)).flatten().map(|rows| (rows, length))
        });
        match rows.filter(|(rows, _)| rows.len() == count) {
            Some((rows, length)) => {
                self.good += 40 + length;
                self.records += 1;
                self.recalled += count;
                Some(rows)
            }
            None => {
                if self.old.take().is_some() {
                    self.cut();
                }
                None
            }
        }
    }

    /// Drops what is not good.
    fn cut(&mut self) {
        let Some(file) = &mut self.new else { return };
        if let Err(e) = file.set_len(self.good).and_then(|()| file.seek(SeekFrom::Start(self.good)).map(drop))
        {
            (self.new, self.failure) = (None, Some(e));
        }
    }

    /// Appends a record.
    pub(crate) fn keep(&mut self, rows: &[Row]) {
        let Some(file) = &mut self.new else { return };
        let bytes = put_rows(rows);
        let mut record = Vec::with_capacity(bytes.len() + 40);
        (bytes.len() as u64).put(&mut record);
        record.extend_from_slice(&checksum(&self.key, self.records, &bytes));
        record.extend_from_slice(&bytes);
        self.records += 1;
        if let Err(e) = file.write_all(&record) {
            (self.new, self.failure) = (None, Some(e));
        }
    }
}

/// Of the job, a record's place among the others, and its bytes.
fn checksum(key: &[u8; 32], number: u64, bytes: &[u8]) -> [u8; 32] {
    *blake3::Hasher::new().update(key).update(&number.to_le_bytes()).update_rayon(bytes).finalize().as_bytes()
}

impl Plain for f16 {
    const SIZE: usize = 2;
    fn put(&self, out: &mut Vec<u8>) {
        self.to_bits().put(out);
    }
    fn get(bytes: &[u8]) -> f16 {
        f16::from_bits(u16::get(bytes))
    }
}

record!(Landing { node: u32, uv: [u16; 2], weight: [f16; 3] } => Landing { node, uv, weight });

fn put_rows(rows: &[Row]) -> Vec<u8> {
    let mut out = Vec::new();
    for row in rows {
        let Row { direct, by_group, landings, dead, kept, variance, rays } = row;
        direct.put(&mut out);
        [*dead, *kept, *variance].put(&mut out);
        rays.put(&mut out);
        put_all(by_group, &mut out);
        put_all(landings, &mut out);
    }
    out
}

fn get_rows(bytes: &[u8]) -> Option<Vec<Row>> {
    let mut reader = Reader(bytes);
    let mut rows = Vec::new();
    while !reader.is_at_end() {
        let direct = reader.one()?;
        let [dead, kept, variance] = reader.one()?;
        let rays = reader.one()?;
        let (by_group, landings) = (reader.all()?.into_boxed_slice(), reader.all()?.into_boxed_slice());
        rows.push(Row { direct, by_group, landings, dead, kept, variance, rays });
    }
    Some(rows)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::Side;
    use geometry::Rgb;

    fn rows(n: u32) -> Vec<Row> {
        let landing = |i| Landing::new(i, Side::Back, 0.25, 0.5, Rgb::splat(0.125));
        (0..n)
            .map(|i| Row {
                direct: Rgb::splat(i as f32),
                landings: (0..i).map(landing).collect(),
                rays: 16,
                ..Row::default()
            })
            .collect()
    }

    fn directs(rows: Option<Vec<Row>>) -> Option<Vec<f32>> {
        rows.map(|rows| rows.iter().map(|r| r.direct.r).collect())
    }

    #[test]
    fn a_journal_is_believed_up_to_its_first_fault() {
        let dir = std::env::temp_dir().join(format!("twolight-journal-{}", std::process::id()));
        let key = [7; 32];
        let write = || {
            let _ = std::fs::remove_file(&dir);
            let mut journal = Journal::at(&dir);
            journal.begin(&key);
            assert!(journal.recall(3).is_none());
            journal.keep(&rows(3));
            assert!(journal.recall(5).is_none());
            journal.keep(&rows(5));
            std::fs::read(&dir).expect("written")
        };
        let whole = write();
        for spoil in 0..4 {
            write();
            let mut bytes = whole.clone();
            match spoil {
                0 => (),
                1 => bytes.truncate(whole.len() - 1),
                2 => bytes[whole.len() - 1] ^= 1,
                _ => bytes[0] ^= 1, // another job
            }
            std::fs::write(&dir, &bytes).expect("writable");
            let mut journal = Journal::at(&dir);
            journal.begin(&key);
            assert_eq!(directs(journal.recall(3)).is_some(), spoil < 3, "{spoil}");
            if spoil == 3 {
                journal.keep(&rows(3));
            }
            assert_eq!(directs(journal.recall(5)).is_some(), spoil == 0, "{spoil}");
            if spoil > 0 {
                journal.keep(&rows(5));
            }
            drop(journal);
            assert_eq!(std::fs::read(&dir).expect("there"), whole, "mended after fault {spoil}");
        }
        let mut journal = Journal::at(&dir);
        journal.begin(&key);
        assert!(journal.recall(4).is_none(), "another number of rows");
        journal.remove();
        assert!(!dir.exists());
    }

    #[test]
    fn a_folder_that_cannot_be_written_stops_nothing() {
        let mut journal = Journal::at(Path::new("/nowhere/at/all"));
        journal.begin(&[0; 32]);
        assert!(journal.recall(1).is_none() && journal.failure().is_some());
        journal.keep(&rows(1));
    }
}
