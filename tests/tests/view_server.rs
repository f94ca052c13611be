//! Checks that the server of `lamp view` answers only who may ask, and that nothing a client sends
//! and nothing that happens to a stack ends it.

use std::fs::OpenOptions;
use std::io::Write;
use std::net::TcpStream;
use std::time::{Duration, Instant};

use lamp_fixtures::SplitMix;
use lamp_stack::{Layer, MaskBuilder, PageInfo};
use lamp_tests::{Answer, Scratch, Viewing, note};
use serde_json::Value;

/// A folder with a stack of 16 layers, and its viewer.
fn viewing() -> (Scratch, Viewing) {
    let scratch = Scratch::with_tower_and_torus();
    let viewing = Viewing::start(&scratch, "torus.tif --threads 2");
    (scratch, viewing)
}

/// Checks what holds for every answer of ours.
#[track_caller]
fn checked(answer: Answer, scratch: &Scratch) -> Answer {
    let policy = answer.header("content-security-policy").unwrap_or_default();
    assert!(policy.contains("default-src 'self'") && !policy.contains("unsafe"), "{answer:?}");
    assert!(!answer.headers.iter().any(|(name, _)| name.starts_with("access-control")));
    assert_eq!(answer.header("cache-control"), Some("no-store"));
    assert_eq!(answer.header("x-content-type-options"), Some("nosniff"));
    let told = format!("{:?} {}", answer.headers, answer.text());
    let folder = scratch.as_ref().to_string_lossy().into_owned();
    for place in [&*folder, "/tmp/", "/home/", env!("CARGO_MANIFEST_DIR")] {
        assert!(!told.contains(place), "{place}: {told}");
    }
    answer
}

/// Checks that an answer is a sentence in JSON.
#[track_caller]
fn refused(answer: Answer, scratch: &Scratch, statuses: &[u16]) {
    let answer = checked(answer, scratch);
    assert!(statuses.contains(&answer.status), "{} {}", answer.status, answer.text());
    let json: Value = serde_json::from_slice(&answer.body)
        .unwrap_or_else(|error| panic!("{error}: {} {}", answer.status, answer.text()));
    assert!(json["error"].as_str().is_some_and(|why| !why.is_empty()), "{json}");
}

#[track_caller]
fn still_answers(viewing: &Viewing) {
    assert_eq!(viewing.get("/tiles/0/0/layer/0/0/0.png").status, 200);
    assert!(!viewing.said().contains("panicked"), "{}", viewing.said());
}

#[test]
fn a_token_opens_once_and_becomes_a_cookie() {
    let scratch = Scratch::with_tower_and_torus();
    let viewing = Viewing::unopened(&scratch, "torus.tif --threads 2", &[]);
    let token = viewing.token();
    assert_eq!(token.len(), 32);
    let first = format!("/?token={token}");
    // Requests that load ahead, or without anybody looking, do not use the token up.
    for purpose in ["Sec-Purpose: prefetch;prerender", "Purpose: prefetch", "X-Moz: prefetch"] {
        let answer = viewing.ask(&viewing.request(&first, &format!("{purpose}\r\n")));
        assert!(answer.header("set-cookie").is_none());
        refused(answer, &scratch, &[403]);
    }
    let head = viewing.request(&first, "").replacen("GET", "HEAD", 1);
    assert_eq!(checked(viewing.ask(&head), &scratch).status, 403);

    let welcome = checked(viewing.ask(&viewing.request(&first, "")), &scratch);
    assert_eq!(welcome.status, 200);
    assert!(welcome.text().contains("0; url=/\"") && !welcome.text().contains(token));
    let cookie = welcome.header("set-cookie").unwrap();
    for attribute in ["; HttpOnly", "; SameSite=Strict", "; Path=/"] {
        assert!(cookie.contains(attribute), "{cookie}");
    }
    assert!(!cookie.contains(token), "the token is good for nothing any more");

    let again = viewing.ask(&viewing.request(&first, ""));
    assert!(again.header("set-cookie").is_none());
    assert!(again.text().contains("end lamp view and start it again"), "{}", again.text());
    refused(again, &scratch, &[403]);

    let cookie = format!("Cookie: {}\r\n", cookie.split(';').next().unwrap());
    for _ in 0..2 {
        let page = viewing.ask(&viewing.request("/", &cookie));
        assert_eq!(checked(page, &scratch).status, 200);
        // Who goes to the first address again is led on, and it is in no link or history.
        let page = checked(viewing.ask(&viewing.request(&first, &cookie)), &scratch);
        assert_eq!((page.status, page.header("location")), (303, Some("/")));
    }
}

/// Arguments are seen by all users of a machine.
#[cfg(unix)]
#[test]
fn a_browser_is_given_a_private_file() {
    use std::os::unix::fs::PermissionsExt;
    use std::path::Path;

    let scratch = Scratch::with_tower_and_torus();
    let (viewing, told) = Viewing::opened(&scratch, "torus.tif");
    let path = Path::new(told.trim_end());
    assert!(path.starts_with(scratch.path("session")), "{told}");
    let mode = std::fs::metadata(path).unwrap().permissions().mode();
    assert_eq!(mode & 0o777, 0o600);
    let page = std::fs::read_to_string(path).unwrap();
    let start = format!("0; url=http://127.0.0.1:{}/?token=", viewing.port);
    let token = page.split_once(&start).unwrap().1.split('"').next().unwrap();
    assert_eq!(token.len(), 32);
    assert!(!told.contains(token) && !told.contains(viewing.token()));

    // It is gone once it was used, which the printed address does not notice.
    let first = viewing.request(&format!("/?token={token}"), "");
    assert_eq!(viewing.ask(&first).status, 200);
    assert!(!path.exists());
    assert_eq!(viewing.ask(&first).status, 403);
    let printed = viewing.request(&format!("/?token={}", viewing.token()), "");
    assert_eq!(
        [viewing.ask(&printed), viewing.ask(&printed)].map(|answer| answer.status),
        [200, 403]
    );
    assert_eq!(viewing.said(), "");
}

#[cfg(unix)]
#[test]
fn a_private_file_that_nobody_used_goes_with_the_viewer() {
    let scratch = Scratch::with_tower_and_torus();
    let session = scratch.path("session");
    let files = || std::fs::read_dir(&session).unwrap().count();
    let (mut viewing, _) = Viewing::opened(&scratch, "torus.tif");
    assert_eq!(files(), 1);
    viewing.interrupt();
    assert_eq!(files(), 0);
    // Nor is one left where there is no browser.
    let nothing = scratch.path("nothing");
    let variables = [("PATH", &*nothing), ("XDG_RUNTIME_DIR", &*session)];
    let viewing = Viewing::unopened(&scratch, "torus.tif --open", &variables);
    let printed = viewing.request(&format!("/?token={}", viewing.token()), "");
    assert_eq!(viewing.ask(&printed).status, 200);
    assert!(viewing.said().contains("open the address above"), "{}", viewing.said());
    assert_eq!(files(), 0);
}

#[test]
fn nothing_but_token_and_cookie_opens() {
    let (scratch, viewing) = viewing();
    let token = viewing.token().to_owned();
    let last = if token.ends_with('0') { "1" } else { "0" };
    let wrong = [
        "",
        &token[1..],
        &format!("{token}0"),
        &format!("{}{last}", &token[..31]),
        &format!("%{token}"),
        &"0".repeat(32),
    ];
    for wrong in wrong {
        let answer = viewing.ask(&viewing.request(&format!("/?token={wrong}"), ""));
        assert!(answer.header("set-cookie").is_none());
        refused(answer, &scratch, &[403]);
        let name = viewing.cookie().split('=').next().unwrap();
        let answer = viewing.ask(&viewing.request("/", &format!("Cookie: {name}={wrong}\r\n")));
        refused(answer, &scratch, &[403]);
    }
    for target in ["/", "/api/session", "/tiles/0/0/layer/0/0/0.png", "/assets/index.html", "/no"] {
        refused(viewing.ask(&viewing.request(target, "")), &scratch, &[403]);
        let with_token = format!("{target}?token={token}");
        if target != "/" {
            refused(viewing.ask(&viewing.request(&with_token, "")), &scratch, &[403]);
        }
    }
    // Another viewer has another secret.
    let other = Viewing::start(&scratch, "tower.tif");
    assert_ne!(other.token(), token);
    let stolen = viewing.cookie().replace(&viewing.port.to_string(), &other.port.to_string());
    let answer = other.ask(&other.request("/", &format!("Cookie: {stolen}\r\n")));
    refused(answer, &scratch, &[403]);
    let many = format!("Cookie: a=b; {}; c\r\n", viewing.cookie());
    assert_eq!(checked(viewing.ask(&viewing.request("/", &many)), &scratch).status, 200);
}

#[test]
fn a_page_of_another_name_gets_nothing() {
    let (scratch, viewing) = viewing();
    let (port, cookie) = (viewing.port, viewing.cookie());
    let ask = |line: &str, hosts: &str| {
        let request =
            format!("GET {line} HTTP/1.1\r\n{hosts}Cookie: {cookie}\r\nConnection: close\r\n\r\n");
        viewing.ask(&request)
    };
    let right = format!("Host: 127.0.0.1:{port}\r\n");
    assert_eq!(ask("/api/session", &right).status, 200);
    let names = [
        format!("evil.example:{port}"),
        format!("127.0.0.1.evil.example:{port}"),
        format!("127.0.0.1:{port}.evil.example"),
        format!("evil.example@127.0.0.1:{port}"),
        "127.0.0.1".to_owned(),
        format!("127.0.0.1:{}", port ^ 1),
        format!("127.0.0.1:0{port}"),
        format!("0.0.0.0:{port}"),
        String::new(),
    ];
    for host in &names {
        refused(ask("/api/session", &format!("Host: {host}\r\n")), &scratch, &[400, 403]);
    }
    refused(ask("/api/session", ""), &scratch, &[400, 403]);
    refused(ask("/api/session", &format!("{right}Host: evil.example\r\n")), &scratch, &[400, 403]);
    refused(ask("http://evil.example/api/session", &right), &scratch, &[400, 403]);
    // Neither the token nor an origin makes up for it.
    let target = format!("/?token={}", viewing.token());
    refused(ask(&target, &format!("Host: evil.example:{port}\r\n")), &scratch, &[400, 403]);
    let origin = format!("{right}Origin: http://evil.example\r\n");
    assert_eq!(checked(ask("/api/session", &origin), &scratch).status, 200);
}

#[test]
fn only_get_is_answered() {
    let (scratch, viewing) = viewing();
    let (port, cookie) = (viewing.port, viewing.cookie());
    for method in ["POST", "PUT", "DELETE", "PATCH", "OPTIONS", "TRACE", "BREW", "get"] {
        for target in ["/", "/api/session", "/tiles/0/0/layer/0/0/0.png", "/no"] {
            let request = |cookie: &str| {
                format!(
                    "{method} {target} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n{cookie}Content-Length: 2\r\nConnection: close\r\n\r\n{{}}"
                )
            };
            let with_cookie = request(&format!("Cookie: {cookie}\r\n"));
            refused(viewing.ask(&with_cookie), &scratch, &[405]);
            refused(viewing.ask(&request("")), &scratch, &[403, 405]);
        }
    }
    let head = format!(
        "HEAD / HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nCookie: {cookie}\r\nConnection: close\r\n\r\n"
    );
    assert_eq!(checked(viewing.ask(&head), &scratch).status, 405);
    let tunnel = format!(
        "CONNECT evil.example:443 HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nCookie: {cookie}\r\n\r\n"
    );
    let status = viewing.ask(&tunnel).status;
    assert!((400..500).contains(&status), "{status}");
    still_answers(&viewing);
}

#[test]
fn what_there_is_not_is_refused() {
    let (scratch, viewing) = viewing();
    let huge = [
        "16",
        "4294967295",
        "4294967296",
        "18446744073709551615",
        "18446744073709551616",
        "99999999999999999999999999",
        "-1",
        "0x0",
        "1e3",
        "",
        " ",
        "%20",
        "NaN",
        "%00",
        "%ff",
    ];
    for number in huge {
        let number = number.replace(' ', "%20");
        for target in [
            format!("/api/stacks/{number}/layers"),
            format!("/api/stacks/0/layers/{number}"),
            format!("/api/stacks/{number}/layers/0"),
            format!("/api/stacks/0/layers/{number}/pixel?x=0&y=0"),
            format!("/api/stacks/0/layers/0/pixel?x={number}99999&y=0"),
            format!("/tiles/{number}/0/layer/0/0/0.png"),
            format!("/tiles/0/{number}/layer/0/0/0.png"),
            format!("/tiles/0/0/layer/0/{number}/0.png"),
            format!("/tiles/0/0/layer/0/0/{number}.png"),
            format!("/tiles/0/0/layer/31/{number}/{number}.png"),
            format!("/tiles/0/0/layer/0/0/0.png?threshold={number}999"),
        ] {
            refused(viewing.get(&target), &scratch, &[400, 404]);
        }
        if number != "16" {
            refused(viewing.get(&format!("/tiles/0/0/layer/{number}/0/0.png")), &scratch, &[404]);
        }
    }
    for target in [
        "/tiles/0/0/nothing/0/0/0.png",
        "/tiles/0/0/added/0/0/0.jpg",
        "/tiles/0/0/layer/0/0/0",
        "/tiles/0/0/layer/0/0/0.png?threshold=0",
        "/tiles/0/0/layer/0/0/0.png?threshold=256",
        "/tiles/0/0/layer/32/0/0.png",
        "/tiles/0/0/layer/31/4294967295/4294967295.png",
        "/api/stacks/0/layers/0/pixel",
        "/api/stacks/0/layers/0/pixel?x=1",
        "/api/stacks/0/layers/0/edge?x=1&y=1",
        "/api/stacks/0/layers/0/edge?x=NaN&y=1&radius=2",
        "/api/stacks/0/layers/0/edge?x=1&y=1&radius=-2",
        "/api/stacks/0/layers/0/edge?x=inf&y=1&radius=2",
        "/api",
        "/api/",
    ] {
        refused(viewing.get(target), &scratch, &[400, 404]);
    }
    // Browsers ask for an icon by this name, and report an error if there is none.
    let icon = checked(viewing.get("/favicon.ico"), &scratch);
    assert_eq!(icon.status, 200, "{}", icon.text());
    // A radius without bounds is cut down; it does not take for ever.
    let far = viewing.get("/api/stacks/0/layers/0/edge?x=1e300&y=-1e300&radius=1e300");
    assert!(checked(far, &scratch).status < 500);
    still_answers(&viewing);
}

#[test]
fn no_path_leads_to_a_file() {
    let (scratch, viewing) = viewing();
    for target in [
        "/../../../../etc/passwd",
        "/assets/../../Cargo.toml",
        "/assets/..%2f..%2fCargo.toml",
        "/assets/%2e%2e/%2e%2e/etc/passwd",
        "/assets/%2e%2e%2f%2e%2e%2fetc%2fpasswd",
        "/assets/..%5c..%5cCargo.toml",
        "/assets/%252e%252e%252fetc",
        "/assets/index.html%00.png",
        "/assets/index.html/",
        "/assets//index.html",
        "/assets/",
        "/assets/%2fetc%2fpasswd",
        "//etc/passwd",
        "/torus.tif",
        "/assets/torus.tif",
        "/tiles/../api/session",
        "/./api/session",
        "/tiles/0/0/layer/0/0/..%2f0.png",
        "/?file=/etc/passwd&token=",
    ] {
        let answer = checked(viewing.get(target), &scratch);
        assert!(!answer.text().contains("root:") && !answer.text().contains("[workspace]"));
        let page = target.starts_with("/?");
        assert!(answer.status == 404 || (page && answer.status == 200), "{target}: {answer:?}");
    }
    for length in [2_000, 20_000, 2_000_000] {
        let target = format!("/{}", "a".repeat(length));
        let request = viewing.request(&target, &format!("Cookie: {}\r\n", viewing.cookie()));
        if let Some(answer) = viewing.send(request.as_bytes()) {
            assert!((400..500).contains(&answer.status), "{length}: {}", answer.status);
        }
    }
    still_answers(&viewing);
}

#[test]
fn half_and_slow_requests_hold_up_nobody() {
    let (_scratch, viewing) = viewing();
    let request = viewing.request("/api/session", &format!("Cookie: {}\r\n", viewing.cookie()));
    let bytes = request.as_bytes();
    // Left half-way, with the connection open and closed.
    let mut open: Vec<TcpStream> = Vec::new();
    for length in (0..bytes.len()).step_by(3) {
        let mut stream = viewing.connect();
        stream.write_all(&bytes[..length]).unwrap();
        if length % 2 == 0 {
            open.push(stream);
        }
    }
    still_answers(&viewing);
    // Byte by byte, while others ask.
    let mut slow = viewing.connect();
    slow.set_nodelay(true).unwrap();
    for byte in bytes {
        slow.write_all(&[*byte]).unwrap();
        std::thread::sleep(Duration::from_millis(2));
    }
    still_answers(&viewing);
    assert_eq!(Answer::read(&mut slow).unwrap().status, 200);
    // A client that asks for much and reads none of it.
    let mut deaf = viewing.connect();
    deaf.set_write_timeout(Some(Duration::from_millis(300))).unwrap();
    let again = request.replace("Connection: close\r\n", "");
    for _ in 0..2_000 {
        if deaf.write_all(again.as_bytes()).is_err() {
            break;
        }
    }
    still_answers(&viewing);
}

#[test]
fn a_thousand_idle_connections_keep_nobody_out() {
    let (_scratch, viewing) = viewing();
    let mut idle = Vec::new();
    let start = Instant::now();
    for _ in 0..1_000 {
        idle.push(viewing.connect());
    }
    still_answers(&viewing);
    let took = start.elapsed();
    assert!(took < Duration::from_secs(20), "{took:?}");
    drop(idle);
    still_answers(&viewing);
}

#[test]
fn a_connection_goes_on_after_an_error() {
    let (_scratch, viewing) = viewing();
    let mut stream = viewing.connect();
    for (target, status) in
        [("/no", 404), ("/api/session", 200), ("/tiles/9/9/layer/0/0/0.png", 404), ("/", 200)]
    {
        let request = viewing.request(target, &format!("Cookie: {}\r\n", viewing.cookie()));
        stream.write_all(request.replace("Connection: close\r\n", "").as_bytes()).unwrap();
        assert_eq!(Answer::read(&mut stream).unwrap().status, status, "{target}");
    }
    for garbage in [
        &b"\r\n\r\n\r\n\r\n"[..],
        b"GET\r\n\r\n",
        b"GET / HTTP/9.9\r\n\r\n",
        b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n",
        b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03",
        b"GET / HTTP/1.1\r\nHost: a\r\nContent-Length: -1\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: a\r\nContent-Length: 99999999999999999999\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: chunked\r\n\r\nzz\r\n",
        b"GET / HTTP/1.1\r\nno colon\r\n\r\n",
        b"GET /\xff\xfe HTTP/1.1\r\nHost: \xff\r\n\r\n",
    ] {
        let mut stream = viewing.connect();
        stream.write_all(garbage).unwrap();
        // A server that waits for more of a request hangs up once we do.
        stream.shutdown(std::net::Shutdown::Write).unwrap();
        if let Some(answer) = Answer::read(&mut stream) {
            assert!((400..500).contains(&answer.status), "{answer:?}");
        }
    }
    still_answers(&viewing);
}

/// A file that changes is not shown any more, and says so; one that only loses its name is.
#[test]
fn a_stack_that_changes_is_a_message() {
    let (scratch, viewing) = viewing();
    let whole = scratch.bytes("torus.tif");
    let file = OpenOptions::new().write(true).open(scratch.path("torus.tif")).unwrap();
    file.set_len(whole.len() as u64 / 3).unwrap();
    for layer in 0..15 {
        let answer = viewing.get(&format!("/tiles/0/{layer}/layer/0/0/0.png"));
        refused(answer, &scratch, &[410]);
    }
    assert_eq!(viewing.get("/api/session").status, 200);
    assert_eq!(viewing.get("/api/stacks/0/layers").status, 200);
    assert!(!viewing.said().contains("panicked"), "{}", viewing.said());

    scratch.write("torus.tif", &whole);
    let mut spoiled = whole.clone();
    let viewing = Viewing::start(&scratch, "torus.tif");
    let middle = spoiled.len() / 2;
    spoiled[middle..middle + 200].fill(0x5a);
    scratch.write("torus.tif", &spoiled);
    refused(viewing.get("/tiles/0/7/layer/0/0/0.png"), &scratch, &[410]);

    scratch.write("torus.tif", &whole);
    let viewing = Viewing::start(&scratch, "torus.tif");
    std::fs::remove_file(scratch.path("torus.tif")).unwrap();
    scratch.write("torus.tif", b"another");
    still_answers(&viewing);
}

#[test]
fn damaged_and_tiny_stacks_are_shown_as_far_as_they_go() {
    let scratch = Scratch::with_tower_and_torus();
    let whole = scratch.bytes("torus.tif");
    scratch.write("cut.tif", &whole[..whole.len() / 2]);
    let viewing = Viewing::start(&scratch, "cut.tif");
    assert!(viewing.said().contains("cut off"), "{}", viewing.said());
    let session: Value = serde_json::from_slice(&viewing.get("/api/session").body).unwrap();
    let layers = session["stacks"][0]["layers"].as_u64().unwrap();
    assert!((1..15).contains(&layers), "{session}");
    assert!(session["stacks"][0]["end"].as_str().unwrap().contains("cut off"), "{session}");
    for layer in 0..layers {
        let answer = viewing.get(&format!("/tiles/0/{layer}/layer/0/0/0.png"));
        assert_eq!(checked(answer, &scratch).status, 200);
    }
    refused(viewing.get(&format!("/tiles/0/{layers}/layer/0/0/0.png")), &scratch, &[404]);

    // One byte of a layer's codes is wrong: that layer alone cannot be shown.
    let mut spoiled = whole.clone();
    let middle = spoiled.len() / 2;
    spoiled[middle] ^= 0x10;
    scratch.write("spoiled.tif", &spoiled);
    let viewing = Viewing::start(&scratch, "spoiled.tif");
    let statuses: Vec<u16> = (0..15)
        .map(|layer| {
            let answer = viewing.get(&format!("/tiles/0/{layer}/layer/0/0/0.png"));
            checked(answer, &scratch).status
        })
        .collect();
    assert!(statuses.iter().filter(|&&status| status == 200).count() >= 7, "{statuses:?}");
    assert!(statuses.iter().any(|&status| status >= 400), "{statuses:?}");
    assert!(!viewing.said().contains("panicked"), "{}", viewing.said());

    let mut pixel = MaskBuilder::new(1);
    pixel.push_row(&[0]).unwrap();
    let layer = Layer { info: PageInfo::default(), pitch: None, image: pixel.finish().into() };
    scratch.stack("pixel.tif", [layer]);
    let viewing = Viewing::start(&scratch, "pixel.tif");
    for reduction in [0, 1, 31] {
        let tile = viewing.get(&format!("/tiles/0/0/layer/{reduction}/0/0.png"));
        assert_eq!(tile.header("content-type"), Some("image/png"));
        assert_eq!(tile.body[16..24], [0, 0, 0, 1, 0, 0, 0, 1], "one pixel by one");
    }
    refused(viewing.get("/tiles/0/0/layer/0/1/0.png"), &scratch, &[404]);
    let found: Value =
        serde_json::from_slice(&viewing.get("/api/stacks/0/layers/0/pixel?x=0&y=0").body).unwrap();
    assert_eq!((&found["level"], &found["component"]["area_px"]), (&255.into(), &1.into()));
}

#[test]
fn memory_stays_within_its_limit() {
    const LAYERS: u32 = 40;
    const LIMIT: u64 = 128_000_000;
    let scratch = Scratch::new();
    // Layers of a million transitions, 4 MB each when decoded: stripes that change sides.
    let layer = |index: u32| {
        let mut mask = MaskBuilder::new(4096);
        for row in 0..500 {
            let stripes: Vec<u32> =
                (0..2000).map(|stripe| 2 * stripe + (row + index) % 7).collect();
            mask.push_row(&stripes).unwrap();
        }
        let info = PageInfo { index, ..PageInfo::default() };
        Layer { info, pitch: None, image: mask.finish().into() }
    };
    scratch.stack("dense.tif", (0..LAYERS).map(layer));
    let viewing = Viewing::start(&scratch, "dense.tif --threads 2 --memory 128MB");
    let mut random = SplitMix(22);
    for _ in 0..3 * LAYERS {
        let layer = random.below(LAYERS as usize);
        viewing.get(&format!("/api/stacks/0/layers/{layer}"));
        for kind in ["layer", "new", "below"] {
            assert_eq!(viewing.get(&format!("/tiles/0/{layer}/{kind}/2/0/0.png")).status, 200);
        }
    }
    let Some(peak) = viewing.peak_memory() else { return };
    assert!(peak <= LIMIT, "{peak} bytes");
}

/// Numbers that stand for a `#`, and words that stand for an `@`.
const NUMBERS: &str =
    "0 0 0 0 0 0 1 1 7 15 16 31 32 255 256 4294967295 -1 1e9 18446744073709551616 %31 x";
const WORDS: &str = "tiles api stacks layers assets session layer new below findings surface \
                     surface.bin pixel edge copies index.html style.css .. %2e%2e % %ff";
const TARGETS: [&str; 10] = [
    "/tiles/0/#/layer/#/0/0.png",
    "/tiles/0/#/layer/0/0/0.png?threshold=#",
    "/tiles/#/#/layer/#/#/#.png",
    "/tiles/0/#/@/#/0/0.png",
    "/api/stacks/0/layers/#",
    "/api/stacks/#/layers/#/pixel?x=#&y=#&threshold=#",
    "/api/stacks/0/layers/#/edge?x=#&y=#&radius=#",
    "/api/@",
    "/assets/@",
    "/@/@/@?@=@",
];

/// A request of parts that are right, wrong, or not even text.
fn random_request(random: &mut SplitMix, viewing: &Viewing) -> Vec<u8> {
    let mut one_of = |list: &str, separator: char| {
        let parts: Vec<&str> = list.split(separator).collect();
        parts[random.below(parts.len())].to_owned()
    };
    let mut target = one_of(&TARGETS.join(" "), ' ');
    while let Some(at) = target.find(['#', '@']) {
        let list = if target[at..].starts_with('#') { NUMBERS } else { WORDS };
        target.replace_range(at..=at, &one_of(list, ' '));
    }
    let method = one_of("GET,GET,GET,GET,GET,GET,POST,G\u{e9}T,", ',');
    let cookie = format!("Cookie: {}\r\n", viewing.cookie());
    let headers = one_of(&format!("{cookie}|{cookie}|{cookie}|{cookie}|Cookie: ;=;;\r\n|"), '|');
    let request = viewing.request(&target, &headers);
    let mut request = request.replacen("GET", &method, 1).into_bytes();
    // Now and then some bytes are others, or missing.
    for _ in 0..[0, 0, 0, 1, 3][random.below(5)] {
        let at = random.below(request.len());
        match random.below(2) {
            0 => request[at] = random.below(256) as u8,
            _ => drop(request.remove(at)),
        }
    }
    request
}

#[test]
fn random_requests_never_fail_the_server() {
    let (scratch, viewing) = viewing();
    let mut random = SplitMix(22);
    let mut counts = [0; 6];
    for _ in 0..3_000 {
        let request = random_request(&mut random, &viewing);
        let mut stream = viewing.connect();
        // It may refuse before the end.
        let _ = stream.write_all(&request);
        if !request.ends_with(b"\r\n\r\n") {
            // More of it would be waited for.
            let _ = stream.shutdown(std::net::Shutdown::Write);
        }
        let Some(answer) = Answer::read(&mut stream) else { continue };
        let text = || String::from_utf8_lossy(&request).into_owned();
        assert!((200..500).contains(&answer.status), "{}: {}", answer.status, text());
        // Input that is not HTTP is refused before it reaches us, without a body.
        if !answer.body.is_empty() {
            checked(answer.clone(), &scratch);
        }
        counts[answer.status as usize / 100] += 1;
    }
    note(&format!("3000 random requests: {} answered, {} refused", counts[2], counts[4]));
    assert!(counts[2] > 100 && counts[4] > 1_000, "{counts:?}");
    still_answers(&viewing);
}
