//! Runs `lamp view`, and talks to it byte by byte.

use std::fs::File;
use std::io::{self, BufRead, BufReader, Read, Seek, Write};
use std::net::{Ipv4Addr, SocketAddr, TcpStream};
use std::process::{Child, Stdio};
use std::time::Duration;

use crate::Scratch;

/// How long an answer may take before a test fails.
const PATIENCE: Duration = Duration::from_secs(60);

/// A viewer that runs until it is dropped.
#[derive(Debug)]
pub struct Viewing {
    server: Child,
    said: File,
    /// The address that it printed, with its token.
    pub address: String,
    /// Its port of the loopback address.
    pub port: u16,
    cookie: String,
}

/// An answer of the viewer.
#[derive(Clone, Debug)]
pub struct Answer {
    /// The status.
    pub status: u16,
    /// Names in small letters, with values.
    pub headers: Vec<(String, String)>,
    /// The bytes behind the headers.
    pub body: Vec<u8>,
}

impl Viewing {
    /// Returns the most memory that the viewer has taken, in bytes; none where the system does not
    /// tell.
    pub fn peak_memory(&self) -> Option<u64> {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.server.id())).ok()?;
        let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
        Some(peak.trim().strip_suffix(" kB")?.parse::<u64>().ok()? * 1024)
    }

    /// Starts `lamp view` in a folder, and waits until it has printed its address.
    ///
    /// # Panics
    /// Panics if it does not.
    #[track_caller]
    pub fn start(scratch: &Scratch, words: &str) -> Self {
        let said = tempfile::tempfile().expect("a temporary file");
        let mut command = scratch.command(&format!("lamp view {words}"));
        command.stdout(Stdio::piped()).stderr(said.try_clone().expect("a file has many handles"));
        let mut server = command.spawn().expect("lamp starts");
        let mut address = String::new();
        let stdout = server.stdout.take().expect("it was asked for");
        BufReader::new(stdout).read_line(&mut address).expect("a line");
        let mut viewing = Self { server, said, address, port: 0, cookie: String::new() };
        let Some((port, token)) = port_and_token(viewing.address.trim()) else {
            panic!("no address in {:?}: {}", viewing.address, viewing.said());
        };
        let token = token.to_owned();
        viewing.port = port;
        let welcome = viewing.ask(&viewing.request(&format!("/?token={token}"), ""));
        let cookie = welcome.header("set-cookie").expect("the token becomes a cookie");
        viewing.cookie = cookie.split(';').next().expect("there is a first part").to_owned();
        viewing
    }

    /// Returns the token of the first address.
    pub fn token(&self) -> &str {
        port_and_token(self.address.trim()).expect("it was read before").1
    }

    /// Returns the cookie that stands for the token, as `name=value`.
    pub fn cookie(&self) -> &str {
        &self.cookie
    }

    /// Returns a request for a target, with lines of headers that end in line breaks.
    pub fn request(&self, target: &str, headers: &str) -> String {
        let port = self.port;
        format!(
            "GET {target} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n{headers}Connection: close\r\n\r\n"
        )
    }

    /// Gets a target with the cookie.
    #[track_caller]
    pub fn get(&self, target: &str) -> Answer {
        self.ask(&self.request(target, &format!("Cookie: {}\r\n", self.cookie)))
    }

    /// Sends a request and returns its answer.
    ///
    /// # Panics
    /// Panics if there is none.
    #[track_caller]
    pub fn ask(&self, request: &str) -> Answer {
        self.send(request.as_bytes()).unwrap_or_else(|| panic!("no answer to {request}"))
    }

    /// Sends bytes on a connection of their own; returns the answer, unless the server hung up.
    pub fn send(&self, bytes: &[u8]) -> Option<Answer> {
        let mut stream = self.connect();
        // It may hang up before the end.
        let _ = stream.write_all(bytes);
        Answer::read(&mut stream)
    }

    /// Connects to it.
    ///
    /// # Panics
    /// Panics if it does not answer any more.
    pub fn connect(&self) -> TcpStream {
        let address = SocketAddr::from((Ipv4Addr::LOCALHOST, self.port));
        let stream = TcpStream::connect_timeout(&address, PATIENCE).expect("the viewer runs");
        stream.set_read_timeout(Some(PATIENCE)).expect("the system has timeouts");
        stream
    }

    /// Returns what it said on standard error.
    ///
    /// # Panics
    /// Panics if that is no text.
    pub fn said(&self) -> String {
        let mut said = String::new();
        let mut file = self.said.try_clone().expect("a file has many handles");
        file.rewind().and_then(|()| file.read_to_string(&mut said)).expect("text");
        said
    }
}

impl Drop for Viewing {
    fn drop(&mut self) {
        // It may have ended.
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}

fn port_and_token(address: &str) -> Option<(u16, &str)> {
    let (port, token) = address.strip_prefix("http://127.0.0.1:")?.split_once("/?token=")?;
    Some((port.parse().ok()?, token))
}

impl Answer {
    /// Reads an answer to its end, as its length tells or the connection closes. Returns none if
    /// the connection closed before the headers were through.
    pub fn read(stream: &mut impl Read) -> Option<Self> {
        let mut reader = BufReader::new(stream);
        let mut head = Vec::new();
        loop {
            let before = head.len();
            reader.read_until(b'\n', &mut head).ok().filter(|&bytes| bytes > 0)?;
            if &head[before..] == b"\r\n" {
                break;
            }
        }
        let head = String::from_utf8_lossy(&head);
        let mut lines = head.lines();
        let status = lines.next()?.split(' ').nth(1)?.parse().ok()?;
        let header = |line: &str| {
            let (name, value) = line.split_once(':')?;
            Some((name.to_ascii_lowercase(), value.trim().to_owned()))
        };
        let mut answer =
            Self { status, headers: lines.filter_map(header).collect(), body: Vec::new() };
        let length = answer.header("content-length").and_then(|length| length.parse().ok());
        // A connection that breaks off leaves what came.
        let _: io::Result<usize> = match length {
            Some(length) => reader.take(length).read_to_end(&mut answer.body),
            None => reader.read_to_end(&mut answer.body),
        };
        Some(answer)
    }

    /// Returns the value of a header.
    pub fn header(&self, name: &str) -> Option<&str> {
        self.headers.iter().find(|(header, _)| header == name).map(|(_, value)| value.as_str())
    }

    /// Returns the body as text.
    pub fn text(&self) -> String {
        String::from_utf8_lossy(&self.body).into_owned()
    }
}
