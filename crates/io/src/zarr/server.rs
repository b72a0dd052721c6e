//! Objects on a server, by HTTP: at an address as it is, or in a bucket of S3, whose addresses are signed where there are credentials.

use std::collections::HashMap;
use std::fmt;
use std::ops::Range;
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use rusty_s3::actions::{GetObject, S3Action};
use rusty_s3::{Bucket, Credentials, UrlStyle};
use tetralod::stream::{HttpOptions, HttpSource, RangeSource, StreamError, WantedRange};

use crate::error::ReadReason;

/// So long an address is good for. It is made for each request.
const SIGNED_FOR: Duration = Duration::from_secs(3600);
/// Without a region, buckets are looked for there.
const REGION: &str = "us-east-1";

/// What is below an address.
pub(super) struct Server {
    root: Root,
    /// Whose connections all requests share.
    connections: Mutex<HttpSource>,
    /// How many bytes objects have, of those that were asked for.
    sizes: Mutex<HashMap<String, Option<u64>>>,
}

enum Root {
    /// In front of the name of an object, and behind it.
    Address([String; 2]),
    Bucket(Box<Bucket>, Option<Credentials>, String),
}

impl fmt::Debug for Server {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Server").finish_non_exhaustive()
    }
}

/// Bytes of an object, and how many it has in all if the server says so.
type Fetched = (Vec<u8>, Option<u64>);

impl Server {
    /// What is below `http://…`, `https://…` or `s3://bucket/…`.
    pub fn of(address: &str) -> Result<Self, ReadReason> {
        let root = match address.strip_prefix("s3://") {
            Some(rest) => bucket(rest, &|name| std::env::var(name).ok().filter(|value| !value.is_empty()))?,
            None => {
                let (path, rest) = address.split_at(address.find(['?', '#']).unwrap_or(address.len()));
                Root::Address([path.trim_end_matches('/').to_owned(), rest.to_owned()])
            }
        };
        let connections = Mutex::new(HttpSource::new(address, HttpOptions::default()));
        Ok(Self { root, connections, sizes: Mutex::default() })
    }

    /// The whole object; none if there is none.
    pub fn whole(&self, key: &str) -> Result<Option<Vec<u8>>, ReadReason> {
        if self.known_size(key) == Some(None) {
            return Ok(None);
        }
        Ok(self.fetch(key, 0..u64::MAX)?.map(|(bytes, _)| bytes))
    }

    /// How many bytes an object has; none if there is none.
    pub fn size(&self, key: &str) -> Result<Option<u64>, ReadReason> {
        if let Some(size) = self.known_size(key) {
            return Ok(size);
        }
        // Not one byte: there are servers that take the end of `bytes=0-0` for none, and send the whole.
        let size = match self.fetch(key, 0..2)? {
            Some((_, Some(total))) => Some(total),
            Some((_, None)) => Some(self.whole(key)?.map_or(0, |bytes| bytes.len() as u64)),
            None => None,
        };
        self.sizes.lock().unwrap_or_else(PoisonError::into_inner).insert(key.to_owned(), size);
        Ok(size)
    }

    /// A part of an object, whose size was asked for before.
    pub fn range(&self, key: &str, range: Range<u64>) -> Result<Vec<u8>, ReadReason> {
        if range.is_empty() {
            return Ok(Vec::new());
        }
        let gone = || failed(&self.shown(key), &StreamError::Changed);
        Ok(self.fetch(key, range)?.ok_or_else(gone)?.0)
    }

    fn known_size(&self, key: &str) -> Option<Option<u64>> {
        self.sizes.lock().unwrap_or_else(PoisonError::into_inner).get(key).copied()
    }

    /// A range of an object and the size of the whole, as far as the server says it; none if there is no such object.
    fn fetch(&self, key: &str, range: Range<u64>) -> Result<Option<Fetched>, ReadReason> {
        let address = match &self.root {
            Root::Address([before, behind]) => format!("{before}/{key}{behind}"),
            Root::Bucket(bucket, credentials, prefix) => {
                let name = joined(prefix, key);
                match credentials {
                    Some(credentials) => {
                        GetObject::new(bucket, Some(credentials), &name).sign(SIGNED_FOR).into()
                    }
                    None => bucket.object_url(&name).into(),
                }
            }
        };
        let mut source = self.connections.lock().unwrap_or_else(PoisonError::into_inner).of_another(&address);
        source.want(&[WantedRange { range, priority: 0.0 }]);
        loop {
            match source.next(Duration::from_secs(1)) {
                Ok(Some((_, bytes))) => return Ok(Some((bytes, source.total()))),
                Ok(None) => {}
                Err(StreamError::Status(404 | 410)) => return Ok(None),
                Err(error) => return Err(failed(&self.shown(key), &error)),
            }
        }
    }

    /// An object in messages: without what its address is signed with.
    fn shown(&self, key: &str) -> String {
        match &self.root {
            Root::Address([before, _]) => format!("{before}/{key}"),
            Root::Bucket(bucket, _, prefix) => format!("s3://{}/{}", bucket.name(), joined(prefix, key)),
        }
    }
}

fn failed(address: &str, error: &StreamError) -> ReadReason {
    ReadReason::Io(format!("{address}: {error}"))
}

fn joined(prefix: &str, key: &str) -> String {
    if prefix.is_empty() { key.to_owned() } else { format!("{prefix}/{key}") }
}

/// A bucket, where the environment says that it is, and the name that all objects begin with.
fn bucket(rest: &str, variable: &dyn Fn(&str) -> Option<String>) -> Result<Root, ReadReason> {
    let first = |names: &[&str]| names.iter().find_map(|name| variable(name));
    let (name, prefix) = rest.split_once('/').unwrap_or((rest, ""));
    let region = first(&["AWS_REGION", "AWS_DEFAULT_REGION"]).unwrap_or_else(|| REGION.to_owned());
    let endpoint = first(&["AWS_ENDPOINT_URL_S3", "AWS_ENDPOINT_URL"]);
    // Names of hosts hold no buckets with dots where there is TLS, and other servers may not know them.
    let style = if endpoint.is_some() || name.contains('.') { UrlStyle::Path } else { UrlStyle::VirtualHost };
    let endpoint = endpoint.unwrap_or_else(|| format!("https://s3.{region}.amazonaws.com"));
    let wrong = |what: &dyn fmt::Display| {
        ReadReason::unsupported(
            format!("the bucket \"{name}\" at {endpoint} ({what})"),
            "check its name, and AWS_ENDPOINT_URL",
        )
    };
    let at = endpoint.parse().map_err(|error| wrong(&error))?;
    let bucket = Bucket::new(at, style, name.to_owned(), region).map_err(|error| wrong(&error))?;
    let key = first(&["AWS_ACCESS_KEY_ID"]).zip(first(&["AWS_SECRET_ACCESS_KEY"]));
    let credentials = key.map(|(key, secret)| match first(&["AWS_SESSION_TOKEN"]) {
        Some(token) => Credentials::new_with_token(key, secret, token),
        None => Credentials::new(key, secret),
    });
    Ok(Root::Bucket(Box::new(bucket), credentials, prefix.trim_end_matches('/').to_owned()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn address_of(rest: &str, variables: &[(&str, &str)]) -> (String, bool) {
        let variable = |name: &str| {
            variables.iter().find(|(known, _)| *known == name).map(|(_, value)| (*value).to_owned())
        };
        let Root::Bucket(bucket, credentials, prefix) = bucket(rest, &variable).expect("it is a bucket")
        else {
            panic!("no bucket")
        };
        let url = bucket.object_url(&joined(&prefix, "zarr.json"));
        (url.to_string(), credentials.is_some())
    }

    #[test]
    fn buckets_are_where_the_environment_says() {
        let plain = address_of("data/a/b.zarr/", &[]);
        assert_eq!(plain, ("https://data.s3.us-east-1.amazonaws.com/a/b.zarr/zarr.json".into(), false));
        let variables = [
            ("AWS_ENDPOINT_URL", "http://localhost:9000"),
            ("AWS_ACCESS_KEY_ID", "key"),
            ("AWS_SECRET_ACCESS_KEY", "secret"),
        ];
        assert_eq!(address_of("data", &variables), ("http://localhost:9000/data/zarr.json".into(), true));
        let elsewhere = address_of("my.data/x.zarr", &[("AWS_REGION", "eu-west-1")]);
        assert_eq!(elsewhere.0, "https://s3.eu-west-1.amazonaws.com/my.data/x.zarr/zarr.json");
        assert!(bucket("data/x", &|_| Some("no address".into())).is_err());
    }
}
