//! The chain in the browser: the folder of `lamp view --work`, and what the page orders of it.

use std::time::{Duration, Instant};

use lamp_fixtures::Sample;
use lamp_stack::Pitch;
use lamp_tests::{Answer, Scratch, Viewing};
use serde_json::{Value, json};

/// A viewer of a folder with a small torus.
fn viewing() -> (Scratch, Viewing) {
    let scratch = Scratch::new();
    std::fs::create_dir(scratch.path("work")).unwrap();
    scratch.part("work/torus.stl", Sample::Torus, 2_000);
    let viewing = Viewing::start(&scratch, "--work work --threads 2");
    (scratch, viewing)
}

fn json_of(answer: &Answer) -> Value {
    serde_json::from_slice(&answer.body).unwrap_or_else(|error| panic!("{error}: {answer:?}"))
}

/// Orders something, and returns how it ended.
fn ordered(viewing: &Viewing, order: &Value) -> Value {
    let body = serde_json::to_vec(order).unwrap();
    let answer = viewing.put("POST", "/api/work/make", "application/json", &body);
    assert_eq!(answer.status, 200, "{}", answer.text());
    ended(viewing)
}

fn ended(viewing: &Viewing) -> Value {
    let start = Instant::now();
    loop {
        let state = json_of(&viewing.get("/api/work"));
        if state["job"]["status"] != "running" {
            return state["job"].clone();
        }
        assert!(start.elapsed() < Duration::from_secs(300), "{state}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

fn order(file: &str, machine: &str, more: &Value) -> Value {
    let mut order = json!({"file": file, "machine": machine, "dpi": null, "thickness": null,
        "rotate": null, "build": null, "replace": false});
    order.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
    order
}

/// The files of an order are those of the commands that the page shows, to the byte.
#[test]
fn an_order_makes_the_bytes_of_its_commands() {
    let (scratch, viewing) = viewing();
    for more in [
        json!({}),
        json!({"thickness": "200um", "rotate": "x:90,z:-12.5"}),
        json!({"thickness": "200um", "rotate": "x:90,z:-12.5",
            "build": {"copies": 2, "mesh": false, "ending": "tif"}}),
        json!({"thickness": "200um", "build": {"copies": null, "mesh": false, "ending": "goo"}}),
        json!({"thickness": "200um", "build": {"copies": 1, "mesh": true, "ending": "lamp"}}),
    ] {
        let job = ordered(&viewing, &order("torus.stl", "mars3", &more));
        assert_eq!(job["status"], "ready", "{job}");
        let file = job["made"]["file"].as_str().unwrap();
        // The same commands in another folder.
        let hand = Scratch::new();
        hand.write("torus.stl", &scratch.bytes("work/torus.stl"));
        for command in job["made"]["commands"].as_array().unwrap() {
            hand.run(&format!("{} -q", command.as_str().unwrap())).succeeds();
        }
        assert!(hand.bytes(file) == scratch.bytes(&format!("work/{file}")), "{job}");
        let sent = viewing.get(&format!("/api/work/files/{file}"));
        assert!(sent.body == hand.bytes(file), "{job}");
        let session = json_of(&viewing.get("/api/session"));
        assert_eq!(session["stacks"][0]["name"], file);
    }
    // A stack is checked and laid out as it is.
    let build = json!({"build": {"copies": 2, "mesh": false, "ending": "ctb"}});
    let job = ordered(&viewing, &order("torus-layers.tif", "mars3", &build));
    assert_eq!(job["made"]["file"], "torus-layers-build.ctb", "{job}");
    assert!(!viewing.said().contains("panicked"), "{}", viewing.said());
}

/// A stack is sliced again exactly if its part or its options changed.
#[test]
fn a_part_is_sliced_again_once_it_changes() {
    let (scratch, viewing) = viewing();
    let layers =
        || std::fs::metadata(scratch.path("work/torus-layers.tif")).unwrap().modified().unwrap();
    let coarse = json!({"thickness": "200um"});
    let make = |more: &Value| {
        let job = ordered(&viewing, &order("torus.stl", "mars3", more));
        assert_eq!(job["status"], "ready", "{job}");
        layers()
    };
    let first = make(&coarse);
    assert_eq!(make(&coarse), first);
    let turned = make(&json!({"thickness": "200um", "rotate": "z:90"}));
    assert_ne!(turned, first);
    let back = make(&coarse);
    assert_ne!(back, turned);
    scratch.part("other.stl", Sample::Torus, 1_000);
    let other = scratch.bytes("other.stl");
    let upload = |query: &str| {
        viewing.put("PUT", &format!("/api/work/files/torus.stl{query}"), "model/stl", &other).status
    };
    // A file of the same name with other bytes is replaced only on request.
    assert_eq!([upload(""), upload("?replace=true"), upload("")], [409, 200, 200]);
    assert!(scratch.bytes("work/torus.stl") == other);
    assert_ne!(make(&coarse), back);
}

/// Only files that orders of the same part wrote are replaced unasked, and nothing is written through
/// a link.
#[test]
fn an_order_replaces_only_its_own_files() {
    let (scratch, viewing) = viewing();
    let body = |replace: bool| {
        let more = json!({"thickness": "200um", "replace": replace});
        serde_json::to_vec(&order("torus.stl", "mars3", &more)).unwrap()
    };
    let make =
        |replace| viewing.put("POST", "/api/work/make", "application/json", &body(replace)).status;
    scratch.write("work/torus-layers.tif", b"of a person");
    assert_eq!(make(false), 409);
    assert_eq!(scratch.bytes("work/torus-layers.tif"), b"of a person");
    assert_eq!(make(true), 200);
    assert_eq!(ended(&viewing)["status"], "ready");
    assert_eq!(make(false), 200);
    assert_eq!(ended(&viewing)["status"], "ready");
    // A part of the same stem has the same product.
    std::fs::copy(scratch.path("work/torus.stl"), scratch.path("work/torus.obj")).unwrap();
    let of_other = serde_json::to_vec(&order("torus.obj", "mars3", &json!({}))).unwrap();
    let other = viewing.put("POST", "/api/work/make", "application/json", &of_other);
    assert_eq!(other.status, 409, "{}", other.text());
    #[cfg(unix)]
    {
        scratch.write("outside.tif", b"outside");
        std::fs::remove_file(scratch.path("work/torus-layers.tif")).unwrap();
        let link = scratch.path("work/torus-layers.tif");
        std::os::unix::fs::symlink(scratch.path("outside.tif"), link).unwrap();
        assert_eq!([make(false), make(true)], [403; 2]);
        assert_eq!(scratch.bytes("outside.tif"), b"outside");
    }
}

/// A machine of one's own whose file changes makes other layers.
#[cfg(unix)]
#[test]
fn a_machine_that_changes_makes_other_layers() {
    let scratch = Scratch::new();
    std::fs::create_dir_all(scratch.path("work")).unwrap();
    std::fs::create_dir_all(scratch.path("config/lamp/machines")).unwrap();
    scratch.part("work/torus.stl", Sample::Torus, 2_000);
    let mars = String::from_utf8(scratch.run("lamp machine show mars3").stdout).unwrap();
    let write = |text: &str| scratch.write("config/lamp/machines/mine.toml", text.as_bytes());
    let mine = mars.replace("name = \"mars3\"", "name = \"mine\"");
    write(&mine);
    let config = scratch.path("config");
    let mut viewing =
        Viewing::unopened(&scratch, "--work work --threads 2", &[("XDG_CONFIG_HOME", &*config)]);
    viewing.open();
    let width = || {
        let job = ordered(&viewing, &order("torus.stl", "mine", &json!({"thickness": "200um"})));
        assert_eq!(job["status"], "ready", "{job}");
        scratch.layers("work/torus-layers.tif")[0].image.width()
    };
    let first = width();
    write(&mine.replace("[4098, 2560]", "[4000, 2560]"));
    assert_eq!([first, width()], [4098, 4000]);
}

#[test]
fn findings_of_what_was_made_are_shown() {
    let (scratch, viewing) = viewing();
    let job = ordered(&viewing, &order("torus.stl", "mars3", &json!({"thickness": "200um"})));
    assert_eq!(job["status"], "ready", "{job}");
    let start = Instant::now();
    let found = loop {
        let found = json_of(&viewing.get("/api/findings"));
        if found["status"] != "running" {
            break found;
        }
        assert!(start.elapsed() < Duration::from_secs(300), "{found}");
    };
    assert_eq!(found["status"], "ready", "{found}");
    // An upright ring begins on the ground, and its top half hangs over.
    let by_hand = scratch.run("lamp check work/torus-layers.tif --machine mars3 --json").stdout;
    let by_hand: Value = serde_json::from_slice(&by_hand).unwrap();
    let kinds = |list: &Value| -> Vec<Value> {
        list.as_array().unwrap().iter().map(|finding| finding["kind"].clone()).collect()
    };
    let records: Vec<Value> = by_hand["features"]
        .as_array()
        .unwrap()
        .iter()
        .map(|feature| by_hand["findings"][feature["finding"].as_u64().unwrap() as usize].clone())
        .collect();
    assert_eq!(kinds(&found["list"]), kinds(&records.into()), "{found} {by_hand}");
    assert!(kinds(&found["list"]).contains(&"overhang".into()), "{found}");
}

#[test]
fn what_cannot_be_made_is_a_sentence() {
    let (scratch, viewing) = viewing();
    scratch.write("work/empty.stl", b"");
    scratch.write("work/text.stl", b"no part");
    let tif = |copies: u32| json!({"build": {"copies": copies, "mesh": false, "ending": "tif"}});
    for (file, machine, more, words) in [
        ("empty.stl", "mars3", json!({}), "empty.stl"),
        ("text.stl", "mars3", json!({}), "text.stl"),
        ("torus.stl", "mars3", json!({"rotate": "x:abc"}), "is not a rotation"),
        ("torus.stl", "mars3", json!({"rotate": "-o evil.tif"}), "is not a rotation"),
        ("torus.stl", "mars3", json!({"dpi": "1500"}), "1500"),
        ("torus.stl", "mars3", tif(4_000), "4000"),
    ] {
        let job = ordered(&viewing, &order(file, machine, &more));
        let message = job["message"].as_str().unwrap_or_default();
        assert!(job["status"] == "failed" && message.contains(words), "{job}");
        let folder = scratch.as_ref().to_string_lossy().into_owned();
        assert!(!job.to_string().contains(&folder), "{job}");
    }
    let session = json_of(&viewing.get("/api/session"));
    assert!(session["work"] == true && session["stacks"].as_array().unwrap().len() <= 1);
    // Nothing was left half.
    assert!(scratch.names_in("work").iter().all(|name| !name.starts_with('.')));
}

#[test]
fn work_that_is_stopped_leaves_nothing() {
    let (scratch, viewing) = viewing();
    let body = serde_json::to_vec(&order(
        "torus.stl",
        "beta",
        &json!({"dpi": "2400", "thickness": "25um"}),
    ))
    .unwrap();
    let make = || viewing.put("POST", "/api/work/make", "application/json", &body);
    assert_eq!(make().status, 200);
    assert_eq!(make().status, 403, "one order at a time");
    assert_eq!(viewing.put("POST", "/api/work/stop", "text/plain", b"").status, 200);
    let job = ended(&viewing);
    assert_eq!((&job["status"], &job["message"]), (&json!("stopped"), &Value::Null));
    assert_eq!(scratch.names_in("work"), ["torus.stl"]);
}

/// Pages of earlier stacks show nothing of others.
#[test]
fn a_page_of_an_earlier_stack_is_refused() {
    let (_scratch, viewing) = viewing();
    let number = || json_of(&viewing.get("/api/session"))["number"].as_u64().unwrap();
    let before = number();
    let job = ordered(&viewing, &order("torus.stl", "mars3", &json!({"thickness": "200um"})));
    assert_eq!(job["status"], "ready", "{job}");
    let now = number();
    assert_ne!(before, now);
    let tile = |of| viewing.get(&format!("/tiles/0/0/layer/0/0/0.png?of={of}")).status;
    assert_eq!([tile(before), tile(now)], [410, 200]);
    assert_eq!(viewing.get(&format!("/api/work?of={before}")).status, 200);
}

/// Nobody but the page sends files and orders, and none of them leads out of the folder.
#[test]
fn nothing_leads_out_of_the_folder() {
    let (scratch, viewing) = viewing();
    scratch.part("outside.stl", Sample::Torus, 500);
    let outside = scratch.bytes("outside.stl");
    let names = || (scratch.names(), scratch.names_in("work"));
    let before = names();
    let absolute = scratch.path("outside.stl").display().to_string().replace('/', "%2F");
    for name in [
        "..%2Foutside.stl",
        "..%5Coutside.stl",
        "%2E%2E%2Foutside.stl",
        &absolute,
        "..",
        ".",
        "%00.stl",
        ".hidden.stl",
        "-o.stl",
        "work%2Ftorus.stl",
        "a.txt",
        "a.toml",
        "stl",
    ] {
        let target = format!("/api/work/files/{name}?replace=true");
        let put = viewing.put("PUT", &target, "model/stl", b"evil").status;
        assert!((400..500).contains(&put), "{name} {put}");
        assert!((400..500).contains(&viewing.get(&target).status), "{name}");
    }
    for (key, value) in [
        ("file", json!("../outside.stl")),
        ("file", json!(absolute)),
        ("file", json!("")),
        ("machine", json!("../mine.toml")),
        ("machine", json!("/etc/passwd")),
        ("machine", json!(7)),
        ("build", json!({"copies": 1, "mesh": false, "ending": "tif/../../evil"})),
        ("build", json!({"copies": 1, "mesh": false, "ending": "svg"})),
        ("build", json!({"copies": 0, "mesh": false, "ending": "tif"})),
        ("output", json!("../evil.tif")),
        ("copies", json!(-1)),
    ] {
        let mut order = order("torus.stl", "mars3", &json!({}));
        order[key] = value;
        let body = serde_json::to_vec(&order).unwrap();
        let answer = viewing.put("POST", "/api/work/make", "application/json", &body);
        assert!((400..500).contains(&answer.status), "{order} {}", answer.text());
    }
    let large = vec![b' '; 1 << 20];
    let answer = viewing.put("POST", "/api/work/make", "application/json", &large);
    assert!((400..500).contains(&answer.status), "{answer:?}");

    // Another server of this machine is the same site to cookies, but not the same origin.
    let (port, cookie) = (viewing.port, viewing.cookie());
    for (origin, cookie) in [
        (String::new(), cookie),
        (format!("Origin: http://127.0.0.1:{}\r\n", port ^ 1), cookie),
        (format!("Origin: https://127.0.0.1:{port}\r\n"), cookie),
        ("Origin: null\r\n".to_owned(), cookie),
        (format!("Origin: http://127.0.0.1:{port}\r\nOrigin: http://evil.example\r\n"), cookie),
        (format!("Origin: http://127.0.0.1:{port}\r\n"), "lamp_view=0"),
    ] {
        for (method, target) in [
            ("PUT", "/api/work/files/evil.stl"),
            ("POST", "/api/work/make"),
            ("POST", "/api/work/stop"),
        ] {
            let request = format!(
                "{method} {target} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nCookie: {cookie}\r\n{origin}\
                 Content-Length: 4\r\nConnection: close\r\n\r\nevil"
            );
            assert_eq!(viewing.ask(&request).status, 403, "{request}");
        }
    }
    assert_eq!(names(), before);
    assert!(scratch.bytes("outside.stl") == outside);

    // Without a folder, there is nothing to send to.
    scratch.stack(
        "layer.tif",
        [lamp_stack::Layer {
            info: lamp_stack::PageInfo::default(),
            pitch: Pitch::of_dpi(300.0),
            image: lamp_stack::Mask::black(9, 9).into(),
        }],
    );
    let viewing = Viewing::start(&scratch, "layer.tif");
    assert_eq!(viewing.put("PUT", "/api/work/files/a.stl", "model/stl", b"x").status, 405);
    assert_eq!(viewing.get("/api/work").status, 404);
    assert_eq!(json_of(&viewing.get("/api/session"))["work"], false);
}

/// A file that breaks off on its way gets no name.
#[test]
fn a_file_that_breaks_off_is_not_kept() {
    use std::io::Write;
    let (scratch, viewing) = viewing();
    let (port, cookie) = (viewing.port, viewing.cookie());
    let mut stream = viewing.connect();
    write!(
        stream,
        "PUT /api/work/files/half.stl HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nCookie: {cookie}\r\n\
         Origin: http://127.0.0.1:{port}\r\nContent-Length: 1000000\r\n\r\n"
    )
    .unwrap();
    stream.write_all(&[7; 1000]).unwrap();
    drop(stream);
    let start = Instant::now();
    // The temporary file goes once the server has noticed.
    while scratch.names_in("work") != ["torus.stl"] || start.elapsed() < Duration::from_millis(300)
    {
        assert!(start.elapsed() < Duration::from_secs(60), "{:?}", scratch.names_in("work"));
        std::thread::sleep(Duration::from_millis(20));
    }
    let sent = viewing.put("PUT", "/api/work/files/whole.stl", "model/stl", &[7; 1_000_000]);
    assert_eq!(sent.status, 200, "{}", sent.text());
    assert_eq!(scratch.bytes("work/whole.stl"), [7; 1_000_000]);
}
