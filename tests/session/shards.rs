//! Promise: a file in shards gives the same meshes as the whole, from disks and from servers of any kind; a shard that is missing, cut off
//! or too long is named, and nothing of it is taken for the file.

use crate::client::{file, requests};
use std::cell::RefCell;
use std::io::{Cursor, Error, ErrorKind};
use std::ops::Range;
use std::rc::Rc;
use std::time::Duration;
use tetralod::Coded;
use tetralod::format::DecodeOptions;
use tetralod::mt::MtKind;
use tetralod::refine::Request;
use tetralod::session::{Client, ClientError, Session};
use tetralod::stream::{
    Action, Arrived, FileSource, Loader, LoaderOptions, RangeSource, ResponseHead, ShardedFile, StreamError,
    WantedRange, shard_suffix,
};

type Shards = Vec<Option<Vec<u8>>>;

/// A file, cut after every `size` bytes.
fn cut(file: &[u8], size: usize) -> Shards {
    file.chunks(size).map(|shard| Some(shard.to_vec())).collect()
}

/// Those of a disk.
fn on_disk(mut shards: Shards) -> Result<FileSource<impl std::io::Read + std::io::Seek>, StreamError> {
    let first = Cursor::new(shards[0].take().expect("it is there"));
    let open = move |suffix: &str| {
        let number: usize = suffix.trim_start_matches('.').parse().expect("a number");
        assert_eq!(suffix, shard_suffix(number as u64));
        let found = shards.get(number).cloned().flatten();
        found.map(Cursor::new).ok_or_else(|| Error::from(ErrorKind::NotFound))
    };
    FileSource::new(ShardedFile::new(first, open).expect("it can be read"))
}

/// How a server answers.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Way {
    /// With ranges, and says how much there is.
    Open,
    /// With ranges, but not even `Content-Range` is to be seen, as of servers elsewhere in pages.
    Hidden,
    /// With whole objects.
    Whole,
}

/// The requests that were made: the shard, and the bytes of it.
type Asked = Rc<RefCell<Vec<(u64, Range<u64>)>>>;

/// Those of a server that has a loader in front of it; with what has been asked of it.
struct Served {
    shards: Shards,
    way: Way,
    /// What it answers for a shard that is not there.
    absent: ResponseHead<'static>,
    loader: Loader,
    now: u64,
    asked: Asked,
}

impl Served {
    fn new(shards: Shards, way: Way) -> Self {
        let options = LoaderOptions { gap: Some(64), max_request_bytes: 20_000, ..LoaderOptions::default() };
        let absent = ResponseHead { status: 404, ..ResponseHead::default() };
        Self { shards, way, absent, loader: Loader::new(options), now: 0, asked: Rc::default() }
    }

    fn answer(&mut self, id: u32, shard: u64, range: Range<u64>) {
        self.asked.borrow_mut().push((shard, range.clone()));
        let Some(Some(bytes)) = self.shards.get(shard as usize) else {
            return self.loader.head(id, self.now, &self.absent);
        };
        let total = bytes.len() as u64;
        let is_hidden = self.way == Way::Hidden;
        let (status, part) = match self.way {
            Way::Whole => (200, 0..total),
            _ if range.start >= total => (416, total..total),
            _ => (206, range.start..range.end.min(total)),
        };
        let content_range = match status {
            416 => format!("bytes */{total}"),
            _ => format!("bytes {}-{}/{total}", part.start, part.end.saturating_sub(1)),
        };
        let head = ResponseHead {
            status,
            content_range: Some(&content_range[..]).filter(|_| !is_hidden && status != 200),
            content_length: (status != 416).then_some(part.end - part.start),
            // Each object has its own.
            etag: Some(if shard == 0 { "\"first\"" } else { "\"other\"" }).filter(|_| !is_hidden),
            ..ResponseHead::default()
        };
        self.loader.head(id, self.now, &head);
        for piece in bytes[part.start as usize..part.end as usize].chunks(1000) {
            self.loader.data(id, self.now, piece);
        }
        self.loader.end(id, self.now);
    }
}

impl RangeSource for Served {
    fn want(&mut self, wanted: &[WantedRange]) {
        self.loader.want(wanted);
    }

    fn next(&mut self, _: Duration) -> Result<Option<Arrived>, StreamError> {
        for _ in 0..10_000 {
            if let Some(arrived) = self.loader.take() {
                return Ok(Some(arrived));
            }
            match self.loader.next(self.now) {
                Some(Action::Fetch { id, shard, range, .. }) => self.answer(id, shard, range),
                Some(Action::Cancel { .. }) => {}
                Some(Action::Wait { until_ms }) => self.now = until_ms,
                None => return self.loader.error().map_or(Ok(None), |error| Err(error.clone())),
                Some(other) => panic!("{other:?}"),
            }
        }
        panic!("it goes on for ever");
    }

    fn total(&self) -> Option<u64> {
        self.loader.total()
    }
}

fn open<S: RangeSource>(source: S) -> Result<Client<S>, ClientError> {
    Client::open(source, DecodeOptions::default(), u64::MAX)
}

/// A client's meshes are those of the whole file.
fn agrees<S: RangeSource>(file: &[u8], source: S, what: &str) {
    let mut whole = Session::new();
    whole.feed(file).expect("a sound file");
    let mut client = open(source).expect(what);
    for request in requests().into_iter().rev().step_by(4) {
        client.refine(&request).expect(what);
        whole.refine(&request).expect("a sound file");
        assert_eq!(client.session().hash(), whole.hash(), "{what}: {request:?}");
    }
    // Where the length of an object is not to be seen, that of the file is known when something of another shard is needed.
    let total = client.total();
    assert!(
        total == Some(file.len() as u64) || total.is_none() && what.contains("Hidden"),
        "{what}: {total:?}"
    );
}

/// From many shards to two of which the last is one byte, and one.
fn sizes(file: &[u8]) -> [usize; 4] {
    [3000, file.len() / 3, file.len() - 1, file.len()]
}

#[test]
fn shards_give_the_meshes_of_the_whole() {
    for kind in [MtKind::HalfEdge, MtKind::Edge] {
        let file = file(kind);
        for size in sizes(&file) {
            let what = format!("{kind:?}, {size} bytes");
            agrees(&file, on_disk(cut(&file, size)).expect("it can be read"), &what);
            for way in [Way::Open, Way::Hidden, Way::Whole] {
                let what = format!("{what}, {way:?}");
                let served = Served::new(cut(&file, size), way);
                let asked = Rc::clone(&served.asked);
                agrees(&file, served, &what);
                let asked = asked.borrow();
                let last = (file.len() - 1) / size;
                let end = |shard: u64| if shard == last as u64 { file.len() - size * last } else { size };
                let beyond = asked.iter().filter(|(shard, range)| range.end > end(*shard) as u64);
                // Before the header has come; and to learn that there are shards, and how long they are.
                assert!(beyond.count() <= 4, "{what}: {asked:?}");
            }
        }
    }
}

/// All bytes come, or the error that it ends with.
fn read<S: RangeSource>(mut source: S, file: &[u8]) -> Result<(), StreamError> {
    let bytes = source.read(&[0..50, 0..file.len() as u64])?;
    assert!(bytes[50..] == *file, "other bytes");
    Ok(())
}

#[test]
fn shards_that_are_missing_cut_off_or_too_long_are_named() {
    let file = file(MtKind::HalfEdge);
    let (size, total) = (file.len() / 3 - 7, file.len() as u64);
    let missing = |number: u64| StreamError::MissingShard {
        suffix: shard_suffix(number),
        from: number * size as u64,
        total,
    };
    let wrong = |suffix: &str, found: usize, expected: usize| StreamError::WrongShard {
        suffix: suffix.to_owned(),
        found: found as u64,
        expected: expected as u64,
    };
    let last = file.len() - 3 * size;
    let with = |number: usize, shard: Option<Vec<u8>>| {
        let mut shards = cut(&file, size);
        shards[number] = shard;
        shards
    };
    let faults = [
        (with(1, None), missing(1)),
        (with(3, None), missing(3)),
        // A file that was cut off is like one whose shards are missing.
        (vec![Some(file[..size].to_vec())], missing(1)),
        (with(2, Some(file[..size - 1].to_vec())), wrong(".0002", size - 1, size)),
        (with(2, Some(Vec::new())), wrong(".0002", 0, size)),
        (with(3, Some(file[..last - 1].to_vec())), wrong(".0003", last - 1, last)),
        (with(1, Some(file.clone())), wrong(".0001", file.len(), size)),
        (with(3, Some(file[..last + 1].to_vec())), wrong(".0003", last + 1, last)),
    ];
    for (shards, error) in faults {
        assert_eq!(on_disk(shards.clone()).and_then(|source| read(source, &file)), Err(error.clone()));
        for way in [Way::Open, Way::Whole] {
            assert_eq!(read(Served::new(shards.clone(), way), &file), Err(error.clone()), "{way:?}");
        }
        let text = error.to_string();
        assert!(text.contains("cut off") && text.contains("shard") && text.contains("`.000"), "{text}");
        let too_long = matches!(error, StreamError::WrongShard { found, expected, .. } if found > expected);
        assert_eq!(error.code(), if too_long { "corrupt" } else { "truncated" });
    }
    // Where lengths are not to be seen.
    let found = read(Served::new(with(1, None), Way::Hidden), &file);
    assert_eq!(found, Err(missing(1)));
    let found = read(Served::new(with(2, Some(file[..size - 1].to_vec())), Way::Hidden), &file);
    assert_eq!(found, Err(wrong(".0002", size - 1, size)));
}

#[test]
fn servers_say_in_several_ways_that_a_shard_is_not_there() {
    let file = file(MtKind::HalfEdge);
    let head = |status| ResponseHead { status, ..ResponseHead::default() };
    let page = ResponseHead { content_type: Some("text/html"), ..head(200) };
    for absent in [head(403), head(404), head(410), page] {
        let shards = cut(&file, file.len() * 3 / 4).into_iter().take(1).collect();
        let served = Served { absent, ..Served::new(shards, Way::Open) };
        assert!(matches!(read(served, &file), Err(StreamError::MissingShard { .. })), "{absent:?}");
    }
    // What is in the shards that are there is shown.
    let shards = cut(&file, file.len() * 3 / 4).into_iter().take(1).collect();
    let mut client = open(Served::new(shards, Way::Open)).expect("its beginning is there");
    assert!(client.refine(&Request::within(0.1)).is_ok());
    assert!(matches!(client.refine(&Request::within(0.0)), Err(ClientError::Stream(_))));
}
