//! A headless Chromium, driven by its WebDriver.

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use fantoccini::wd::{Capabilities, WebDriverCompatibleCommand};
use fantoccini::{Client, ClientBuilder, Locator};
use hyper_util::client::legacy::connect::HttpConnector;
use lamp_tests::{Viewing, note};
use serde_json::{Value, json};
use tokio::runtime::{self, Runtime};
use url::{ParseError, Url};

/// How long the page may take before a test fails. Machines of tests may be slow.
const PATIENCE_MS: u64 = 60_000;

/// Where the pictures of a page are; it has them twice, the second time in its navigator.
const CANVAS: &str = "#sheets > * > .openseadragon-canvas";

/// A page in a browser that ends with it.
pub(crate) struct Browser {
    runtime: Runtime,
    client: Option<Client>,
    driver: Child,
    /// Addresses of the page's server, which alone may be asked.
    server: String,
}

impl Browser {
    /// Opens the page of `lamp view` in a window of a size, or says why it cannot.
    pub(crate) fn open(viewing: &Viewing, window: [u32; 2]) -> Option<Self> {
        Self::open_by(viewing, viewing.address.trim(), window)
    }

    /// Opens the page by another address that leads to it.
    pub(crate) fn open_by(
        viewing: &Viewing,
        address: &str,
        [width, height]: [u32; 2],
    ) -> Option<Self> {
        let chromium = ["chromium", "chromium-browser", "google-chrome"]
            .into_iter()
            .find(|name| Command::new(name).arg("--version").output().is_ok());
        let driver = Command::new("chromedriver").arg("--port=0").stdout(Stdio::piped()).spawn();
        let (Some(chromium), Ok(mut driver)) = (chromium, driver) else {
            note(
                "Chromium or chromedriver is not installed: the viewer is not tested in a browser",
            );
            return None;
        };
        let port = port_of(&mut driver);
        let runtime = runtime::Builder::new_current_thread().enable_all().build().unwrap();
        let capabilities = capabilities(chromium, width, height);
        let connected = runtime.block_on(
            ClientBuilder::new(HttpConnector::new())
                .capabilities(capabilities)
                .connect(&format!("http://127.0.0.1:{port}")),
        );
        let server = format!("http://127.0.0.1:{}/", viewing.port);
        let browser = Self { runtime, client: connected.ok(), driver, server };
        if browser.client.is_none() {
            note("Chromium does not start: the viewer is not tested in a browser");
            return None;
        }
        browser.runtime.block_on(browser.client().goto(address)).unwrap();
        browser.settle();
        Some(browser)
    }

    fn client(&self) -> &Client {
        self.client.as_ref().expect("it is there until the end")
    }

    /// Runs a script in the page and returns what it returns.
    #[track_caller]
    pub(crate) fn run(&self, script: &str, arguments: Vec<Value>) -> Value {
        self.runtime.block_on(self.client().execute(script, arguments)).unwrap()
    }

    /// Loads the page again.
    #[track_caller]
    pub(crate) fn reload(&self) {
        self.runtime.block_on(self.client().refresh()).unwrap();
        self.settle();
    }

    /// Waits until a condition of the page holds.
    #[track_caller]
    pub(crate) fn wait_for(&self, condition: &str) {
        // Received data is drawn in the next frame.
        let script = format!(
            "const done = arguments[0]; const end = Date.now() + {PATIENCE_MS};
             const look = () => {{
               if ({condition}) requestAnimationFrame(() => requestAnimationFrame(() => done(true)));
               else if (Date.now() > end) done(false);
               else setTimeout(look, 20);
             }};
             look();"
        );
        let came = self.runtime.block_on(self.client().execute_async(&script, Vec::new()));
        let message = || self.run("return document.querySelector('#message').textContent", vec![]);
        assert_eq!(came.unwrap(), json!(true), "{condition} does not come: {}", message());
    }

    /// Waits until all tiles of the view have come and are drawn, and the facts of the layer, which move
    /// what is below them: a click would go to another place.
    #[track_caller]
    pub(crate) fn settle(&self) {
        // A change of the view reaches the address and the tiles a moment later.
        std::thread::sleep(Duration::from_millis(250));
        self.wait_for(&format!(
            "document.querySelector('{CANVAS}')?.ariaBusy === 'false'
               && document.querySelector('#layer-facts').ariaBusy !== 'true'
             || document.body.className === 'empty'"
        ));
    }

    /// Waits until these sheets are shown, and no others.
    #[track_caller]
    pub(crate) fn shows(&self, sheets: &[&str]) {
        let shown = sheets.join(" ");
        self.wait_for(&format!("document.querySelector('{CANVAS}').dataset.shown === '{shown}'"));
        self.settle();
    }

    /// Goes to a view, as a link does.
    #[track_caller]
    pub(crate) fn go(&self, hash: &str) {
        // The page takes the view in an event: a click before it would be undone by it.
        let script = "const [hash, done] = arguments;
             if (location.hash === hash) return done(true);
             addEventListener('hashchange', () => setTimeout(() => done(true)), { once: true });
             location.hash = hash;";
        let went = self.client().execute_async(script, vec![json!(hash)]);
        self.runtime.block_on(went).unwrap();
        self.settle();
    }

    /// The part of the page's address behind `#`, by its keys.
    #[track_caller]
    pub(crate) fn place(&self) -> Value {
        self.run("return Object.fromEntries(new URLSearchParams(location.hash.slice(1)))", vec![])
    }

    /// Presses a key where the focus is.
    #[track_caller]
    pub(crate) fn press(&self, key: char) {
        self.type_where_the_focus_is(&key.to_string());
    }

    /// Presses keys where the focus is.
    #[track_caller]
    pub(crate) fn type_where_the_focus_is(&self, keys: &str) {
        let pressed = async { self.client().active_element().await?.send_keys(keys).await };
        self.runtime.block_on(pressed).unwrap();
    }

    /// Clicks an element.
    #[track_caller]
    pub(crate) fn click(&self, selector: &str) {
        let clicked = async { self.client().find(Locator::Css(selector)).await?.click().await };
        self.runtime.block_on(clicked).unwrap();
    }

    /// Types into a field, and Enter.
    #[track_caller]
    pub(crate) fn type_into(&self, selector: &str, text: &str) {
        let typed = async {
            let field = self.client().find(Locator::Css(selector)).await?;
            field.clear().await?;
            field.send_keys(&format!("{text}\u{e007}")).await
        };
        self.runtime.block_on(typed).unwrap();
    }

    /// The text of an element.
    #[track_caller]
    pub(crate) fn text(&self, selector: &str) -> String {
        let text = async { self.client().find(Locator::Css(selector)).await?.text().await };
        self.runtime.block_on(text).unwrap()
    }

    /// The screen's picture, as a PNG file.
    pub(crate) fn screenshot(&self) -> Vec<u8> {
        self.runtime.block_on(self.client().screenshot()).unwrap()
    }

    /// Returns the colors of pixels of the image, `[column, row]` each, as the canvas has them in
    /// their middle; pixels off the screen are missing.
    #[track_caller]
    pub(crate) fn colours(&self, pixels: &[[u32; 2]]) -> Vec<Option<[u8; 3]>> {
        let script = format!(
            "const fields = new URLSearchParams(location.hash.slice(1));
             const [cx, cy] = fields.get('at').split(',').map(Number);
             const zoom = Number(fields.get('zoom'));
             const canvas = document.querySelector('{CANVAS} > canvas');
             const {{width, height}} = canvas;
             const all = canvas.getContext('2d').getImageData(0, 0, width, height).data;
             return arguments[0].map(([x, y]) => {{
               const column = Math.floor((x + 0.5 - cx) * zoom + width / 2);
               const row = Math.floor((y + 0.5 - cy) * zoom + height / 2);
               if (column < 0 || row < 0 || column >= width || row >= height) return null;
               const at = 4 * (row * width + column);
               return [all[at], all[at + 1], all[at + 2]];
             }});"
        );
        serde_json::from_value(self.run(&script, vec![json!(pixels)])).unwrap()
    }

    /// Counts the pixels of the screen that are neither black nor white.
    pub(crate) fn shades(&self) -> u64 {
        let script = format!(
            "const canvas = document.querySelector('{CANVAS} > canvas');
             const {{width, height}} = canvas;
             const all = canvas.getContext('2d').getImageData(0, 0, width, height).data;
             return all.filter((level, at) => at % 4 === 0 && level > 0 && level < 255).length;"
        );
        self.run(&script, Vec::new()).as_u64().unwrap()
    }

    /// Checks that nothing but the server was asked, and that the console has no error.
    #[track_caller]
    pub(crate) fn was_quiet(&self) {
        for entry in self.log("browser") {
            assert_ne!(entry["level"], "SEVERE", "the console says {}", entry["message"]);
        }
        let mut asked = 0;
        for entry in self.log("performance") {
            let message: Value = serde_json::from_str(entry["message"].as_str().unwrap()).unwrap();
            let message = &message["message"];
            if message["method"] != "Network.requestWillBeSent" {
                continue;
            }
            let address = message["params"]["request"]["url"].as_str().unwrap();
            let is_ours = [self.server.as_str(), "blob:", "data:"]
                .iter()
                .any(|start| address.starts_with(start));
            assert!(is_ours, "{address} was asked");
            asked += 1;
        }
        assert!(asked > 20, "the log of {asked} requests cannot be whole");
    }

    fn log(&self, kind: &'static str) -> Vec<Value> {
        let entries = self.runtime.block_on(self.client().issue_cmd(Log(kind))).unwrap();
        entries.as_array().unwrap().clone()
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        if let Some(client) = self.client.take() {
            let _ = self.runtime.block_on(client.close());
        }
        let _ = self.driver.kill();
        let _ = self.driver.wait();
    }
}

/// Reads the port that a driver chose.
fn port_of(driver: &mut Child) -> u16 {
    let lines = BufReader::new(driver.stdout.take().unwrap()).lines();
    let port = lines.map_while(Result::ok).find_map(|line| {
        line.strip_prefix("ChromeDriver was started successfully on port ")?
            .trim_end_matches('.')
            .parse()
            .ok()
    });
    port.expect("chromedriver says its port")
}

fn capabilities(chromium: &str, width: u32, height: u32) -> Capabilities {
    let arguments = json!([
        "--headless=new",
        // Chromium refuses to run as root with its sandbox, as it does in containers.
        "--no-sandbox",
        "--disable-dev-shm-usage",
        "--disable-background-networking",
        "--enable-unsafe-swiftshader",
        "--force-device-scale-factor=1",
        "--force-prefers-reduced-motion",
        "--hide-scrollbars",
        format!("--window-size={width},{height}"),
    ]);
    let json = json!({
        "browserName": "chrome",
        "goog:chromeOptions": {"binary": path_of(chromium), "args": arguments},
        "goog:loggingPrefs": {"browser": "ALL", "performance": "ALL"},
        "timeouts": {"script": 2 * PATIENCE_MS},
    });
    json.as_object().unwrap().clone()
}

/// Chromedriver wants a path, not a name.
fn path_of(program: &str) -> String {
    let folders = std::env::var_os("PATH").unwrap();
    let paths = std::env::split_paths(&folders).map(|folder| folder.join(program));
    paths.into_iter().find(|path| path.is_file()).unwrap().to_string_lossy().into_owned()
}

/// Chromedriver's command that reads a log and empties it.
#[derive(Debug)]
struct Log(&'static str);

impl WebDriverCompatibleCommand for Log {
    fn endpoint(&self, base: &Url, session: Option<&str>) -> Result<Url, ParseError> {
        base.join(&format!("session/{}/se/log", session.unwrap_or_default()))
    }

    fn method_and_body(&self, _: &Url) -> (hyper::Method, Option<String>) {
        (hyper::Method::POST, Some(json!({"type": self.0}).to_string()))
    }
}
