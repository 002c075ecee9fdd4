//! Chromium, driven by the DevTools protocol over its pipe: JSON texts that end with a zero byte, no socket and no package.
//!
//! In: a file and a window's width. Out: what the page says of itself, what its console said, a picture. The program is `CHROMIUM`,
//! or the first of `chromium`, `chromium-browser` and `google-chrome` that there is.

#![allow(dead_code)] // Two test programs share it, and neither needs all of it.

use std::{
    fs,
    io::{BufRead, BufReader, Write},
    path::Path,
    process::{Child, ChildStdin, Command, Stdio},
    sync::mpsc::{Receiver, channel},
    thread,
    time::Duration,
};

use data_encoding::BASE64;
use serde_json::{Value, json};
use tempfile::TempDir;

/// A command that takes longer than this hangs.
const PATIENCE: Duration = Duration::from_secs(120);

/// A browser with one page.
pub struct Browser {
    child: Child,
    to: ChildStdin,
    from: Receiver<Value>,
    next: u64,
    session: Option<String>,
    events: Vec<Value>,
    page: String,
    _profile: TempDir,
}

impl Drop for Browser {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The browser's program.
fn program() -> String {
    let named = std::env::var("CHROMIUM").ok();
    let known = ["chromium", "chromium-browser", "google-chrome"].map(str::to_string);
    let there = |name: &String| {
        Command::new(name)
            .arg("--version")
            .output()
            .is_ok_and(|output| output.status.success())
    };
    let found = named.into_iter().chain(known).find(there);
    found.expect("a browser: install chromium, or name one in CHROMIUM")
}

impl Browser {
    /// Starts one.
    pub fn start() -> Self {
        let profile = tempfile::tempdir().expect("a folder");
        let mut child = Command::new("sh")
            // The pipe is file descriptors 3 and 4.
            .args([
                "-c",
                "exec \"$@\" 3<&0 4>&1 </dev/null >/dev/null 2>&1",
                "sh",
                &program(),
            ])
            .args([
                "--headless",
                "--no-sandbox",
                "--disable-gpu",
                "--disable-quic",
                "--no-first-run",
                "--hide-scrollbars",
            ])
            .args([
                "--disable-background-networking",
                "--disable-component-update",
                "--disable-sync",
                "--remote-debugging-pipe",
            ])
            .arg(format!("--user-data-dir={}", profile.path().display()))
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("a shell");
        let (Some(to), Some(out)) = (child.stdin.take(), child.stdout.take()) else {
            panic!("no pipe to the browser")
        };
        let (sender, from) = channel();
        thread::spawn(move || {
            for part in BufReader::new(out).split(0).map_while(Result::ok) {
                let said = serde_json::from_slice(&part).expect("JSON from the browser");
                if sender.send(said).is_err() {
                    break;
                }
            }
        });
        let mut browser = Browser {
            child,
            to,
            from,
            next: 0,
            session: None,
            events: Vec::new(),
            page: String::new(),
            _profile: profile,
        };
        let target = browser.call("Target.createTarget", json!({"url": "about:blank"}));
        let attached = browser.call(
            "Target.attachToTarget",
            json!({"targetId": target["targetId"], "flatten": true}),
        );
        browser.session = attached["sessionId"].as_str().map(str::to_string);
        for domain in ["Page", "Runtime", "Log", "Network"] {
            browser.call(&format!("{domain}.enable"), json!({}));
        }
        browser
    }

    /// A command and its answer.
    pub fn call(&mut self, method: &str, params: Value) -> Value {
        self.next += 1;
        let mut command = json!({"id": self.next, "method": method, "params": params});
        if let Some(session) = &self.session {
            command["sessionId"] = json!(session);
        }
        self.to
            .write_all(format!("{command}\0").as_bytes())
            .expect("a browser that listens");
        loop {
            let said = self
                .from
                .recv_timeout(PATIENCE)
                .unwrap_or_else(|_| panic!("{method}: no answer"));
            if said["id"] == json!(self.next) {
                assert!(said.get("error").is_none(), "{method}: {}", said["error"]);
                return said["result"].clone();
            }
            self.events.push(said);
        }
    }

    /// Waits for an event.
    fn wait(&mut self, method: &str) {
        while !self.events.iter().any(|event| event["method"] == json!(method)) {
            let said = self
                .from
                .recv_timeout(PATIENCE)
                .unwrap_or_else(|_| panic!("{method} never came"));
            self.events.push(said);
        }
    }

    /// A window of this width, light or dark.
    pub fn window(&mut self, width: u32, is_dark: bool) {
        let phone = width < 600;
        let metrics = json!({"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": phone});
        self.call("Emulation.setDeviceMetricsOverride", metrics);
        self.call("Emulation.setTouchEmulationEnabled", json!({"enabled": phone}));
        let scheme = if is_dark { "dark" } else { "light" };
        let features = json!([{"name": "prefers-color-scheme", "value": scheme}]);
        self.call("Emulation.setEmulatedMedia", json!({"features": features}));
    }

    /// Opens a file, to the end of its loading.
    pub fn open(&mut self, file: &Path) {
        self.events.clear();
        let path = fs::canonicalize(file).expect("a page");
        self.page = format!("file://{}", path.display());
        self.call("Page.navigate", json!({"url": self.page}));
        self.wait("Page.loadEventFired");
    }

    /// The value of an expression; of a promise, what it comes to.
    pub fn eval(&mut self, expression: &str) -> Value {
        let asked = json!({"expression": expression, "returnByValue": true, "awaitPromise": true});
        let said = self.call("Runtime.evaluate", asked);
        assert!(
            said.get("exceptionDetails").is_none(),
            "{expression}: {}",
            said["exceptionDetails"]
        );
        said["result"]["value"].clone()
    }

    /// Brings each plot into the window once, so that it is made.
    pub fn look_at_all(&mut self) {
        self.eval(
            "(async () => { for (const one of document.querySelectorAll('[data-panel], [data-scene]')) { one.scrollIntoView({block: 'center'}); \
             await new Promise((then) => requestAnimationFrame(() => setTimeout(then, 30))); } scrollTo(0, 0); \
             await new Promise((then) => requestAnimationFrame(() => setTimeout(then, 30))); })()",
        );
    }

    /// Errors of scripts and what the page may not do.
    pub fn complaints(&mut self) -> Vec<String> {
        self.eval("0");
        let bad = self.events.iter().filter(|event| match event["method"].as_str() {
            Some("Runtime.exceptionThrown") => true,
            Some("Log.entryAdded") => event["params"]["entry"]["level"] == json!("error"),
            Some("Runtime.consoleAPICalled") => event["params"]["type"] == json!("error"),
            _ => false,
        });
        bad.map(Value::to_string).collect()
    }

    /// Everything that was asked for beyond the page itself.
    pub fn requests(&self) -> Vec<String> {
        let sent = self
            .events
            .iter()
            .filter(|event| event["method"] == json!("Network.requestWillBeSent"));
        let urls = sent.filter_map(|event| event["params"]["request"]["url"].as_str().map(str::to_string));
        urls.filter(|url| *url != self.page).collect()
    }

    /// A part of the page, by a selector: left, top, width, height in the window.
    pub fn place(&mut self, selector: &str) -> [f64; 4] {
        let said = self.eval(&format!(
            "(() => {{ const one = document.querySelector({}); one.scrollIntoView({{block: 'center'}}); const box = one.getBoundingClientRect(); \
             return [box.left, box.top, box.width, box.height]; }})()",
            json!(selector)
        ));
        serde_json::from_value(said).expect("four numbers")
    }

    fn mouse(&mut self, kind: &str, x: f64, y: f64, buttons: u32) {
        let button = if buttons > 0 || kind == "mouseReleased" {
            "left"
        } else {
            "none"
        };
        let event = json!({"type": kind, "x": x, "y": y, "button": button, "buttons": buttons, "clickCount": 1});
        self.call("Input.dispatchMouseEvent", event);
    }

    /// Moves the mouse to a share of a part.
    pub fn point(&mut self, selector: &str, share: f64) {
        let [left, top, width, height] = self.place(selector);
        self.mouse("mouseMoved", left + share * width, top + 0.5 * height, 0);
        self.frame();
    }

    /// Drags from one share of a part to another.
    pub fn drag(&mut self, selector: &str, from: f64, to: f64) {
        let [left, top, width, height] = self.place(selector);
        let y = top + 0.5 * height;
        self.mouse("mouseMoved", left + from * width, y, 0);
        self.mouse("mousePressed", left + from * width, y, 1);
        for step in 1..=4 {
            self.mouse(
                "mouseMoved",
                left + (from + (to - from) * f64::from(step) / 4.0) * width,
                y,
                1,
            );
        }
        self.mouse("mouseReleased", left + to * width, y, 0);
        self.frame();
    }

    /// Two fingers on a part, from these shares to those.
    pub fn pinch(&mut self, selector: &str, from: [f64; 2], to: [f64; 2]) {
        let [left, top, width, height] = self.place(selector);
        let touches =
            |shares: [f64; 2]| shares.map(|share| json!({"x": left + share * width, "y": top + 0.5 * height}));
        let mut send = |kind: &str, points: &[Value]| {
            self.call("Input.dispatchTouchEvent", json!({"type": kind, "touchPoints": points}));
        };
        send("touchStart", &touches(from));
        for step in 1..=4 {
            let part = f64::from(step) / 4.0;
            send(
                "touchMove",
                &touches([0, 1].map(|k| from[k] + part * (to[k] - from[k]))),
            );
        }
        send("touchEnd", &[]);
        self.frame();
    }

    /// Presses a key.
    pub fn key(&mut self, key: &str) {
        for kind in ["keyDown", "keyUp"] {
            self.call("Input.dispatchKeyEvent", json!({"type": kind, "key": key}));
        }
        self.frame();
    }

    /// Until the next picture is drawn.
    pub fn frame(&mut self) {
        self.eval("new Promise((then) => requestAnimationFrame(() => setTimeout(then, 20)))");
    }

    /// A picture of the whole page.
    pub fn picture(&mut self, file: &Path) {
        let asked = json!({"format": "png", "captureBeyondViewport": true});
        let said = self.call("Page.captureScreenshot", asked);
        keep(file, &said);
    }

    /// The page as it is printed.
    pub fn print(&mut self, file: &Path) {
        let said = self.call(
            "Page.printToPDF",
            json!({"printBackground": true, "preferCSSPageSize": true}),
        );
        keep(file, &said);
    }
}

fn keep(file: &Path, said: &Value) {
    let bytes = BASE64
        .decode(said["data"].as_str().unwrap_or_default().as_bytes())
        .expect("base64");
    fs::write(file, bytes).expect("written");
}
