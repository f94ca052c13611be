//! Runs `lamp view`, and talks to it byte by byte.

use std::fs::{self, File};
use std::io::{self, BufRead, BufReader, Read, Seek, Write};
use std::net::{Ipv4Addr, SocketAddr, TcpStream};
use std::path::Path;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

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
    /// Returns the most memory that the viewer has taken, in bytes; `None` where the system does
    /// not report it.
    pub fn peak_memory(&self) -> Option<u64> {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.server.id())).ok()?;
        let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
        Some(peak.trim().strip_suffix(" kB")?.parse::<u64>().ok()? * 1024)
    }

    /// Starts `lamp view` in a folder, waits until it has printed its address, and opens that for
    /// the cookie.
    ///
    /// # Panics
    /// Panics if it does not.
    #[track_caller]
    pub fn start(scratch: &Scratch, words: &str) -> Self {
        let mut viewing = Self::unopened(scratch, words, &[]);
        viewing.open();
        viewing
    }

    /// Opens its address for the cookie.
    ///
    /// # Panics
    /// Panics if no cookie comes.
    #[track_caller]
    pub fn open(&mut self) {
        let welcome = self.ask(&self.request(&format!("/?token={}", self.token()), ""));
        let cookie = welcome.header("set-cookie").expect("the token becomes a cookie");
        self.cookie = cookie.split(';').next().expect("there is a first part").to_owned();
    }

    /// Starts `lamp view` with some environment variables, and leaves its address, which works
    /// once, to others. There is no cookie then.
    ///
    /// # Panics
    /// Panics if it does not print its address.
    #[track_caller]
    pub fn unopened(scratch: &Scratch, words: &str, variables: &[(&str, &Path)]) -> Self {
        let said = tempfile::tempfile().expect("a temporary file");
        let mut command = scratch.command(&format!("lamp view {words}"));
        command.envs(variables.iter().copied());
        command.stdout(Stdio::piped()).stderr(said.try_clone().expect("a file has many handles"));
        let mut server = command.spawn().expect("lamp starts");
        let mut address = String::new();
        let stdout = server.stdout.take().expect("it was asked for");
        BufReader::new(stdout).read_line(&mut address).expect("a line");
        let mut viewing = Self { server, said, address, port: 0, cookie: String::new() };
        let Some((port, _)) = port_and_token(viewing.address.trim()) else {
            panic!("no address in {:?}: {}", viewing.address, viewing.said());
        };
        viewing.port = port;
        viewing
    }

    /// Starts `lamp view --open` with a browser that only records its arguments, and waits for
    /// these, each in a line. The printed address is left to others.
    ///
    /// # Panics
    /// Panics if no browser is started.
    #[cfg(unix)]
    #[track_caller]
    pub fn opened(scratch: &Scratch, words: &str) -> (Self, String) {
        use std::os::unix::fs::PermissionsExt;
        // `told` gets its name once it is whole.
        const OPENER: &[u8] =
            b"#!/bin/sh\nprintf '%s\\n' \"$@\" > \"$0.new\"\nmv \"$0.new\" \"$0.told\"\n";
        let [programs, session] = ["programs", "session"].map(|name| scratch.path(name));
        for folder in [&programs, &session] {
            fs::create_dir_all(folder).expect("the folder can be written to");
        }
        let opener = programs.join("xdg-open");
        fs::write(&opener, OPENER).expect("the folder can be written to");
        fs::set_permissions(&opener, PermissionsExt::from_mode(0o755)).expect("it is ours");
        let system = std::env::var_os("PATH").unwrap_or_default();
        let folders = std::iter::once(programs).chain(std::env::split_paths(&system));
        let path = std::env::join_paths(folders).expect("folders were split before");
        let variables = [("PATH", Path::new(&path)), ("XDG_RUNTIME_DIR", &*session)];
        let viewing = Self::unopened(scratch, &format!("{words} --open"), &variables);
        let start = Instant::now();
        while start.elapsed() < PATIENCE {
            if let Ok(told) = fs::read_to_string(opener.with_extension("told")) {
                return (viewing, told);
            }
            std::thread::sleep(Duration::from_millis(10));
        }
        panic!("no browser was started: {}", viewing.said());
    }

    /// Ends it as Ctrl-C does.
    ///
    /// # Panics
    /// Panics if it does not end.
    #[cfg(unix)]
    pub fn interrupt(&mut self) {
        let process = self.server.id().to_string();
        let kill = std::process::Command::new("kill").args(["-INT", &process]).status();
        assert!(kill.expect("systems have kill").success());
        self.server.wait().expect("it ends");
    }

    /// Returns the token of the first address.
    pub fn token(&self) -> &str {
        port_and_token(self.address.trim()).expect("it was read before").1
    }

    /// Returns the cookie that the token became, as `name=value`.
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

    /// Sends bytes to a target as the page does, with the cookie.
    #[track_caller]
    pub fn put(&self, method: &str, target: &str, kind: &str, body: &[u8]) -> Answer {
        let (port, cookie, length) = (self.port, &self.cookie, body.len());
        let head = format!(
            "{method} {target} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nCookie: {cookie}\r\n\
             Origin: http://127.0.0.1:{port}\r\nContent-Type: {kind}\r\n\
             Content-Length: {length}\r\nConnection: close\r\n\r\n"
        );
        let request = [head.as_bytes(), body].concat();
        self.send(&request).unwrap_or_else(|| panic!("no answer to {method} {target}"))
    }

    /// Sends a request and returns its answer.
    ///
    /// # Panics
    /// Panics if there is no answer.
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

    /// Returns its text on standard error.
    ///
    /// # Panics
    /// Panics if it is not text.
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
    /// Reads an answer to its end: its stated length, or the end of the connection. Returns `None`
    /// if the connection closed before the headers were complete.
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
        // A broken connection leaves the bytes received so far.
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
