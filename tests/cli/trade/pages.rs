//! The page: it parses without an error, holds every number of the JSON, and needs nothing from outside. The settings that may
//! change the time only have changed no byte; the front is a front; CSV, JSON and page say the same.

use common::place;
use html5ever::tendril::TendrilSink as _;
use html5ever::{ParseOpts, parse_document};
use markup5ever_rcdom::{Handle, NodeData, RcDom};
use serde_json::Value;

/// What a page holds.
#[derive(Default)]
struct Page {
    text: String,
    elements: Vec<String>,
    attributes: Vec<(String, String)>,
}

impl Page {
    fn parse(bytes: &[u8]) -> Self {
        let mut input = bytes;
        let dom = parse_document(RcDom::default(), ParseOpts::default()).from_utf8().read_from(&mut input);
        let dom = dom.expect("readable");
        assert_eq!(*dom.errors.borrow(), Vec::<std::borrow::Cow<'static, str>>::new());
        let mut page = Self::default();
        page.visit(&dom.document);
        page
    }

    fn visit(&mut self, node: &Handle) {
        match &node.data {
            NodeData::Text { contents } => self.text += &format!("{} ", contents.borrow()),
            NodeData::Element { name, attrs, .. } => {
                self.elements.push(name.local.to_string());
                let pairs = attrs.borrow();
                self.attributes.extend(pairs.iter().map(|a| (a.name.local.to_string(), a.value.to_string())));
            }
            _ => {}
        }
        node.children.borrow().iter().for_each(|child| self.visit(child));
    }

    fn needs_nothing(&self) {
        for tag in ["script", "link", "iframe", "object", "embed", "base", "form", "audio", "video"] {
            assert!(!self.elements.iter().any(|element| element == tag), "{tag}");
        }
        for (name, value) in &self.attributes {
            assert!(!name.starts_with("on"), "{name}");
            if ["src", "href", "srcset", "action", "data", "poster", "background"].contains(&name.as_str()) {
                assert!(value.starts_with("data:image/png;base64,"), "{name}={value}");
            }
            assert!(name == "src" || !value.contains("//"), "{name}={value}");
            assert!(!value.contains("url("), "{name}={value}");
        }
        assert!(!self.text.contains("@import") && !self.text.contains("url("));
    }

    /// The words, without what stands around numbers.
    fn words(&self) -> Vec<&str> {
        self.text.split_whitespace().map(|word| word.trim_matches([',', '.', ':', '(', ')'])).collect()
    }
}

/// All numbers of a JSON value.
fn numbers(value: &Value, found: &mut Vec<f64>) {
    match value {
        Value::Number(number) => found.push(number.as_f64().expect("a number")),
        Value::Array(values) => values.iter().for_each(|value| numbers(value, found)),
        Value::Object(fields) => {
            fields.iter().filter(|(name, _)| *name != "schema").for_each(|(_, value)| numbers(value, found));
        }
        _ => {}
    }
}

fn points<'a>(report: &'a Value, list: &str) -> &'a Vec<Value> {
    report[list].as_array().expect("a list")
}

/// Measures and checks everything that does not depend on the mode.
fn measured(line: &str) -> (Value, Page) {
    let place = place!();
    place.quiet_run(&format!("trade --rounds 1 -o t.html --json t.json --csv t.csv --plot t.svg {line}"));
    assert_eq!(place.names(), ["t.csv", "t.html", "t.json", "t.svg"]);
    let (report, page) = (place.json("t.json"), Page::parse(&place.bytes("t.html")));
    page.needs_nothing();
    let (words, mut all) = (page.words(), Vec::new());
    numbers(&report, &mut all);
    assert!(all.len() > 50);
    for number in all {
        assert!(words.contains(&number.to_string().as_str()), "{number} is not on the page of {line}");
    }
    front_is_a_front(&report);
    for point in points(&report, "time_only").iter().chain(points(&report, "points")) {
        assert_eq!(point["same_bytes"], true, "{point}");
        assert!(words.contains(
            &point["command"].as_str().expect("a command").split(' ').next_back().expect("a word")
        ));
    }
    let csv = String::from_utf8(place.bytes("t.csv")).expect("UTF-8");
    assert_eq!(csv.lines().count(), 1 + points(&report, "points").len() + points(&report, "time_only").len());
    assert!(csv.lines().all(|line| line.split(',').count() >= 14), "{csv}");
    let svg = String::from_utf8(place.bytes("t.svg")).expect("UTF-8");
    assert!(svg.starts_with("<svg ") && svg.contains("xmlns=\"http://www.w3.org/2000/svg\""));
    (report, page)
}

/// No point is faster and no worse than one of the front, and what is not on it is beaten.
fn front_is_a_front(report: &Value) {
    let place = |point: &Value| ["ms", "rmse"].map(|name| point[name].as_f64().expect("a number"));
    let all = points(report, "points");
    for point in all {
        let at = place(point);
        let beats = |other: &Value| {
            let other = place(other);
            other[0] <= at[0] && other[1] <= at[1] && other != at
        };
        assert_eq!(point["front"], !all.iter().any(beats), "{point}");
    }
    assert_eq!(all.iter().filter(|point| point["default"] == true).count(), 1);
}

/// The point with a label.
fn labelled<'a>(report: &'a Value, label: &str) -> &'a Value {
    points(report, "points").iter().find(|point| point["label"] == label).expect("the point")
}

#[test]
fn pictures_are_measured() {
    let (report, page) = measured("builtin:umbel:3000 --reference 64 -- --size 96x54");
    assert_eq!((&report["mode"], &report["reference"]), (&"render".into(), &64.into()));
    let error = |label: &str| labelled(&report, label)["rmse"].as_f64().expect("a number");
    assert!(error("16") < error("4") && error("4") < error("1"));
    // Each of six numbers of samples and fast has its picture.
    let pictures = page.elements.iter().filter(|element| *element == "img").count();
    assert_eq!(pictures, 7);
    assert!(labelled(&report, "--accuracy fast")["changed"]["ids"].is_u64());
    for partition in ["given", "spatial", "sampled"] {
        let label = format!("path general, partition {partition}");
        assert!(points(&report, "time_only").iter().any(|point| point["label"] == label.as_str()), "{label}");
    }
}

#[test]
fn surfaces_on_demand_are_measured() {
    let (report, page) = measured("--mode reyes --reference 16 -- --size 64x36");
    assert_eq!((&report["mode"], &report["reference"]), (&"reyes".into(), &16.into()));
    assert_eq!(report["scene"]["name"], "builtin:teapot");
    let error = |rate: &str, samples: &str| {
        let is_it = |point: &&Value| {
            let series = point["series"].as_str().expect("a name");
            series.starts_with(&format!("shading rate {rate},")) && point["label"] == samples
        };
        let point = points(&report, "points").iter().find(is_it).expect("the point");
        point["rmse"].as_f64().expect("a number")
    };
    // Smaller micropolygons and more samples are both better.
    assert!(error("0.25", "8") < error("2", "8") && error("0.5", "8") < error("0.5", "1"));
    assert_eq!(page.elements.iter().filter(|element| *element == "img").count(), 16);
}

#[test]
fn shadows_are_measured() {
    let (report, _) = measured("builtin:cornell --mode shadow -- --size 120x90");
    assert_eq!(labelled(&report, "exact mask")["rmse"], 0.0);
    let error = |label: &str| labelled(&report, label)["rmse"].as_f64().expect("a number");
    assert!(error("1024") < error("64"));
    // A sun has no cube.
    let (report, _) = measured("builtin:cornell --mode shadow -- --size 60x40 --sun 1,3,1");
    assert_eq!(points(&report, "points").len(), 2);
}

#[test]
fn bakes_are_measured() {
    let (report, _) = measured("builtin:cornell --mode bake --reference 256");
    let errors = |label: &str| labelled(&report, label)["rmse"].as_f64().expect("a number");
    assert!(errors("64") < errors("8"));
    let groups = points(&report, "time_only").iter().filter(|point| point["label"] == "group origin").count();
    assert_eq!(groups, 1);
    let with_maps = |report: &Value| {
        let is_map = |point: &&Value| point["command"].as_str().expect("a command").contains("--depth-maps");
        points(report, "points").iter().filter(is_map).count()
    };
    assert_eq!(with_maps(&report), 4);
    // A map knows nothing of a greatest distance.
    let (report, _) = measured("builtin:cornell --mode bake --reference 64 -- --vertices --max-distance 20%");
    assert_eq!(with_maps(&report), 0);
}

/// The command lines that a page shows can be typed.
#[test]
fn command_lines_of_a_page_run() {
    let place = place!();
    for mode in ["bake", "shadow", "render"] {
        let size = if mode == "bake" { "" } else { "-- --size 32x20" };
        place.quiet_run(&format!("trade builtin:umbel:500 --rounds 1 --mode {mode} --json t.json -q {size}"));
        for list in ["points", "time_only"] {
            for point in points(&place.json("t.json"), list) {
                let line = point["command"].as_str().expect("a command");
                let run = place.run(line.strip_prefix("umbel ").expect("the program"));
                assert_eq!(run.code, Some(0), "{line}: {}", run.stderr);
            }
        }
    }
}
