//! The page and the npm package: inside of this program, or in a folder.

use crate::serve;
use anyhow::{Context, Result, bail, ensure};
use axum::Router;
use axum::http::{StatusCode, Uri, header};
use axum::response::{IntoResponse, Response};
use std::borrow::Cow;
use std::fs;
use std::path::{Path, PathBuf};

/// Files by their paths; none where the program was compiled without them.
mod inside {
    include!(concat!(env!("OUT_DIR"), "/page.rs"));
}

pub enum Page {
    Inside,
    Folder(PathBuf),
}

impl Page {
    /// The page in a folder if there is one, else that in this program.
    pub fn of(folder: Option<&Path>) -> Result<Self> {
        match folder {
            Some(folder) => {
                let is_there = folder.join("index.html").is_file() && folder.join("pkg/viewer.js").is_file();
                ensure!(is_there, "--page {}: there is no page with pkg/viewer.js", folder.display());
                Ok(Self::Folder(folder.to_owned()))
            }
            None if inside::FILES.is_empty() => bail!(
                "this program was compiled without the page: released ones have it; in a checkout, `cargo xtask build` and then \
                 `cargo install --path cli --features page` make one"
            ),
            None => Ok(Self::Inside),
        }
    }

    /// A file of it.
    pub fn read(&self, path: &str) -> Result<Cow<'static, [u8]>> {
        match self {
            Self::Inside => {
                let found = inside::FILES.iter().find(|(name, _)| *name == path);
                let (_, bytes) =
                    found.with_context(|| format!("this program was compiled without {path}"))?;
                Ok(Cow::Borrowed(bytes))
            }
            Self::Folder(folder) => {
                let path = folder.join(path);
                Ok(Cow::Owned(fs::read(&path).with_context(|| path.display().to_string())?))
            }
        }
    }

    pub fn router(&self) -> Result<Router> {
        match self {
            Self::Inside => Ok(Router::new().fallback(found)),
            Self::Folder(folder) => serve::folder("", folder),
        }
    }
}

/// The file that an address names.
async fn found(address: Uri) -> Response {
    let path = match address.path().trim_start_matches('/') {
        "" => "index.html",
        path => path,
    };
    let Some((_, bytes)) = inside::FILES.iter().find(|(name, _)| *name == path) else {
        return serve::with_status(StatusCode::NOT_FOUND);
    };
    let kind = mime_guess::from_path(path).first_or_octet_stream();
    ([(header::CONTENT_TYPE, kind.as_ref())], *bytes).into_response()
}
