//! Tools, resources and prompts, and what a server has to bear.

use std::fs;

use serde_json::{Value, json};

use super::client::{Client, read};
use crate::harness::{folder, matterixc_in, root, write};

const WARM: &str = "mtx 1\n\nuse std::glassware::Beaker250mL\nuse std::furniture::OpticalTable\n\nlab bench {\n    ambient: 22 degC\n    \
    table = OpticalTable at (0, 0, 0) m\n    b = Beaker250mL on table holding 100 g of water\n}\n\n\
    workflow w(pause: Duration = 5 s) in bench {\n    wait pause\n    expect b.contents.mass == 100 g +- 1 g\n}\n";

fn names(list: &Value) -> Vec<&str> {
    list.as_array().expect("a list").iter().filter_map(|x| x["name"].as_str()).collect()
}

#[test]
fn tools_are_listed_with_what_they_take_and_give() {
    let mut client = Client::new(&folder("mcp_list"));
    let tools = client.ask("tools/list", json!({}))["result"]["tools"].take();
    assert_eq!(names(&tools), ["check", "fix", "explain", "contents", "run", "plan", "library", "format"]);
    for tool in tools.as_array().expect("tools") {
        for schema in ["inputSchema", "outputSchema"] {
            assert_eq!(tool[schema]["type"], "object", "{tool}");
            for (name, property) in tool[schema]["properties"].as_object().expect("properties") {
                assert!(property["description"].is_string(), "{} {schema} {name}", tool["name"]);
            }
        }
        assert_eq!(tool["inputSchema"]["additionalProperties"], false);
        let writes = ["fix", "format"].iter().any(|name| tool["name"] == *name);
        assert_eq!(tool["annotations"]["readOnlyHint"], !writes, "{tool}");
    }
    let prompts = client.ask("prompts/list", json!({}))["result"]["prompts"].take();
    assert_eq!(names(&prompts), ["write-protocol", "repair-protocol"]);
    let prompt = client.ask("prompts/get", json!({ "name": "repair-protocol", "arguments": { "path": "a.mtx" } }));
    assert!(prompt["result"]["messages"][0]["content"]["text"].as_str().expect("text").contains("`a.mtx`"));
    assert!(client.ask("prompts/get", json!({ "name": "repair-protocol" }))["error"].is_object());

    let resources = client.ask("resources/list", json!({}))["result"]["resources"].take();
    for resource in resources.as_array().expect("resources") {
        let page = client.ask("resources/read", json!({ "uri": resource["uri"] }));
        assert!(page["result"]["contents"][0]["text"].as_str().is_some_and(|t| t.len() > 200), "{resource}");
    }
    for (uri, says) in [("mtx://codes/unit-mismatch", "# unit-mismatch"), ("mtx://library/std::heating", "IkaRctBasic")]
    {
        let page = client.ask("resources/read", json!({ "uri": uri }));
        assert!(page["result"]["contents"][0]["text"].as_str().is_some_and(|t| t.contains(says)), "{page}");
    }
    assert!(client.ask("resources/read", json!({ "uri": "file:///etc/passwd" }))["error"].is_object());
    assert_eq!(client.close(), Some(0));
}

#[test]
fn a_check_says_what_the_command_says_and_names_corrections() {
    let dir = folder("mcp_check");
    let wrong = WARM.replace("==", "=").replace("100 g of water", "100 g of watr");
    write(&dir, "w.mtx", &wrong);
    let mut client = Client::new(&dir);
    let mut data = client.data("check", json!({ "path": "w.mtx" }));
    let ended = matterixc_in(&dir, &["check", "w.mtx", "--format", "json"]);
    let mut ids = Vec::new();
    for finding in data["findings"].as_array_mut().expect("findings") {
        for fix in finding["fixes"].as_array_mut().expect("fixes") {
            ids.push(fix.as_object_mut().expect("an object").remove("id").expect("an id"));
        }
    }
    assert_eq!(data["findings"], Value::from(ended.out_lines()));
    assert_eq!(data["errors"], ended.out_lines().len());

    let text = read(&client.call("check", json!({ "text": wrong })));
    assert!(ids.iter().all(|id| text.contains(id.as_str().expect("text"))), "{text}");
    let fixed = client.data("fix", json!({ "path": "w.mtx", "ids": ids, "write": true }));
    assert_eq!(
        (&fixed["written"], &fixed["text"]),
        (&json!(true), &json!(fs::read_to_string(dir.join("w.mtx")).expect("it")))
    );
    let twice = "mtx 1\nuse std::glassware::Beaker250mL\n\nlab bench {\n    ambient: 22 degC\n    b = Beaker250ml holding 1 g of water\n}\n";
    let found = client.data("check", json!({ "text": twice }));
    let id = &found["findings"][0]["fixes"][0]["id"];
    let fixed = client.data("fix", json!({ "text": twice, "ids": [id, id] }));
    assert_eq!(fixed["applied"].as_array().map(Vec::len), Some(1), "{found} {fixed}");
    let stale = client.refused("fix", json!({ "path": "w.mtx", "ids": ids }));
    assert!(stale.contains("this text has no fix"), "{stale}");
    assert_eq!(client.close(), Some(0));
}

#[test]
fn a_protocol_is_run_scheduled_looked_into_and_formatted() {
    let dir = folder("mcp_run");
    write(&dir, "w.mtx", WARM);
    let mut client = Client::new(&dir);
    let data = client.data("run", json!({ "path": "w.mtx", "workflow": "w", "set": { "pause": "7 s" }, "seed": 3 }));
    assert_eq!(
        (&data["passed"], &data["report"]["end"], &data["report"]["seed"]),
        (&json!(true), &json!(7.0), &json!(3))
    );
    let ended = matterixc_in(&dir, &["run", "w.mtx", "--set", "pause=7 s", "--seed", "3", "--format", "json"]);
    assert_eq!(data["report"], serde_json::from_str::<Value>(&ended.out).expect("a report"));
    let data = client.data("run", json!({ "path": "w.mtx", "members": ["status", "expectations"] }));
    assert_eq!(data["report"].as_object().expect("a report").len(), 2);
    let data = client.data("run", json!({ "path": "w.mtx", "bytes": 1000 }));
    assert!(!data["left_out"].as_array().expect("names").is_empty() && data["report"]["status"] == "passed", "{data}");
    // What only a run can tell.
    let warm = include_str!("../../../src/template/warm.mtx").replace("in 25 degC .. 60 degC", "in 25 degC .. 26 degC");
    let data = client.data("run", json!({ "text": warm }));
    assert_eq!((&data["passed"], &data["report"]["status"]), (&json!(false), &json!("missed")));
    let data = client.data("run", json!({ "text": WARM.replace("water", "watr") }));
    assert_eq!((&data["report"], &data["findings"][0]["code"]), (&Value::Null, &json!("unknown-name")));
    let none = client.refused("run", json!({ "path": "w.mtx", "members": ["statu"] }));
    assert!(none.contains("no member `statu`; use schema"), "{none}");

    let data = client.data("plan", json!({ "path": "w.mtx", "search": 1 }));
    assert_eq!(data["schedule"]["makespan"], 5.0, "{data}");
    let result = client.call("contents", json!({ "text": WARM }));
    assert_eq!(result["structuredContent"]["workflows"][0]["workflow"], "w");
    assert!(read(&result).contains("water"), "{result}");
    let data = client.data("contents", json!({ "text": WARM, "line": 13 }));
    assert_eq!(data["workflows"][0]["statements"].as_array().map(Vec::len), Some(1));
    let far = client.refused("contents", json!({ "text": WARM, "line": 99 }));
    assert!(far.contains("lines"), "{far}");

    write(&dir, "ugly.mtx", WARM.replace("    ", " "));
    let data = client.data("format", json!({ "path": "ugly.mtx" }));
    assert_eq!((&data["changed"], &data["written"], &data["text"]), (&json!(true), &json!(false), &json!(WARM)));
    client.data("format", json!({ "path": "ugly.mtx", "write": true }));
    assert_eq!(fs::read_to_string(dir.join("ugly.mtx")).expect("it"), WARM);
    assert_eq!(client.close(), Some(0));
}

#[test]
fn the_library_is_searched_and_codes_explained() {
    let mut client = Client::new(&folder("mcp_library"));
    let modules = client.data("library", json!({}))["modules"].take();
    assert!(names(&modules).contains(&"std::heating"), "{modules}");
    for (words, first) in
        [("ika hotplate", "Ika"), ("kinetic panda", "Panda"), ("place on", "place"), ("96 well plate", "96")]
    {
        let items = client.data("library", json!({ "words": words, "items": 5 }))["items"].take();
        let found = names(&items);
        assert!(found.iter().any(|n| n.contains(first)) && found.len() <= 5, "{words}: {found:?}");
    }
    let items = client.data("library", json!({ "words": "beaker", "module": "std::glassware" }))["items"].take();
    assert!(items.as_array().expect("items").iter().all(|i| i["module"] == "std::glassware"));
    let item = &items[0];
    assert!(item["signature"].as_str().is_some_and(|s| s.starts_with("asset")), "{item}");
    let text = client.data("library", json!({ "module": "std::heating" }))["text"].take();
    assert!(text.as_str().is_some_and(|t| t.starts_with("mtx 1\n")));
    assert!(client.refused("library", json!({ "module": "std::nothing" })).contains("no module"));

    let page = client.data("explain", json!({ "code": "error[unit-mismatch]" }))["page"].take();
    assert!(page.as_str().is_some_and(|p| p.starts_with("# unit-mismatch")));
    assert!(client.refused("explain", json!({ "code": "unit-mismach" })).contains("did you mean `unit-mismatch`?"));
}

#[test]
fn what_does_not_fit_is_said_in_words_and_the_session_goes_on() {
    let dir = folder("mcp_bad");
    write(&dir, "w.mtx", WARM);
    let mut client = Client::new(&dir);
    for (tool, arguments, says) in [
        ("check", json!({}), "either `path` or `text`"),
        ("check", json!({ "path": "w.mtx", "text": "mtx 1" }), "either `path` or `text`"),
        ("check", json!({ "pth": "w.mtx" }), "unknown field `pth`"),
        ("check", json!({ "path": 7 }), "invalid type"),
        ("check", json!({ "path": "w.mtx", "fidelity": "exact" }), "unknown variant `exact`"),
        ("check", json!({ "path": "w.mtx", "seconds": 0 }), "from 1 to 600"),
        ("check", json!({ "path": "no.mtx" }), "the file does not exist"),
        ("check", json!({ "path": "" }), "is a directory"),
        ("check", json!({ "path": "w.mtx\u{0}" }), "cannot read"),
        ("fix", json!({ "path": "w.mtx" }), "either `ids` or `which`"),
        ("fix", json!({ "text": WARM, "which": "all", "write": true }), "has no file to write"),
        ("run", json!({ "path": "w.mtx", "bytes": 1 }), "`bytes` must be from"),
        ("run", json!({ "path": "w.mtx", "unseen": "2mm" }), "`--unseen` needs"),
        ("run", json!({ "path": "w.mtx", "unseen": "2", "fidelity": "motion" }), "`unseen`: write a length"),
        ("run", json!({ "path": "w.mtx", "really": "grip=0.5", "fidelity": "motion" }), "needs `--fidelity contact`"),
        ("contents", json!({ "path": "w.mtx", "column": 3 }), "`column` needs a `line`"),
        ("plan", json!({ "path": "w.mtx", "search": 10000 }), "`search` must be from"),
    ] {
        let why = client.refused(tool, arguments.clone());
        assert!(why.contains(says), "{tool} {arguments}: {why}");
    }
    let error = client.ask("tools/call", json!({ "name": "deploy", "arguments": {} }))["error"].take();
    assert!(error["message"].as_str().is_some_and(|m| m.contains("unknown tool `deploy`; use check")), "{error}");
    assert!(client.ask("tools/lis", json!({}))["error"].is_object());
    assert!(client.ask("tools/call", json!({ "arguments": {} }))["error"].is_object());
    client.line("this is not json");
    client.line("[]");
    client.line("{\"jsonrpc\":\"2.0\",\"method\":\"notifications/unheard\"}");
    client.line("");
    assert!(client.ask("ping", json!({}))["error"].is_null());

    // Brackets without end, a line that is too long for any message, and one that is only long.
    let deep = format!("mtx 1\nlab l {{ a = {} }}", "(".repeat(20_000));
    assert_ne!(client.data("check", json!({ "text": deep }))["errors"], 0);
    client.line(&"x".repeat(17 << 20));
    let long = format!("mtx 1\n{}\n", "// words and words\n".repeat(100_000));
    assert_eq!(client.data("check", json!({ "text": long, "fidelity": "process" }))["errors"], 0);
    assert_eq!(client.close(), Some(0));
}

#[cfg(unix)]
#[test]
fn nothing_outside_of_the_folder_is_read_or_written() {
    let dir = folder("mcp_root");
    let inside = dir.join("in");
    fs::create_dir_all(inside.join("sub")).expect("a folder");
    write(&dir, "secret.mtx", "mtx 1\n//! secret\n");
    write(&dir, "twin.mtx", "mtx 1\n");
    write(&inside, "w.mtx", WARM);
    let link = |to: &str, at: &str| std::os::unix::fs::symlink(to, inside.join(at)).expect("a link");
    link("../secret.mtx", "link.mtx");
    link("..", "up");
    link("w.mtx", "here.mtx");
    let mut client = Client::new(&inside);
    let whole = dir.join("secret.mtx").to_str().expect("text").to_string();
    for path in [
        "../secret.mtx",
        "link.mtx",
        "up/secret.mtx",
        "sub/../../secret.mtx",
        &whole,
        "/etc/passwd",
        "../none.mtx",
        "/none/x",
    ] {
        for (tool, more) in [
            ("check", json!({})),
            ("format", json!({ "write": true })),
            ("fix", json!({ "which": "all", "write": true })),
        ] {
            let mut arguments = more;
            arguments["path"] = json!(path);
            let why = client.refused(tool, arguments);
            assert!(why.contains("is outside the folder of the server"), "{path}: {why}");
        }
    }
    for path in ["w.mtx", "here.mtx", "sub/../w.mtx", inside.join("w.mtx").to_str().expect("text")] {
        assert_eq!(client.data("check", json!({ "path": path }))["errors"], 0, "{path}");
    }
    // Imports and data go the same way.
    for module in ["link", "up::secret"] {
        let data = client.data("check", json!({ "text": format!("mtx 1\nuse {module}::x\n") }));
        assert_eq!(data["findings"][0]["code"], "unknown-module", "{data}");
    }
    for file in ["../secret.mtx", "up/secret.mtx", "/etc/passwd"] {
        let text = format!("mtx 1\nuse std::bodies::Body\nasset A: Body from labware \"{file}\" {{}}\n");
        let data = client.data("check", json!({ "text": text }));
        let said = data.to_string();
        assert!(said.contains("outside the allowed folder") && !said.contains("root:"), "{said}");
    }
    assert_eq!(client.close(), Some(0));
    assert_eq!(fs::read_to_string(dir.join("secret.mtx")).expect("it"), "mtx 1\n//! secret\n");
}

#[test]
fn a_call_can_be_cancelled_and_ends_when_its_time_is_over() {
    let endless = "mtx 1\nlab bench {\n    ambient: 22 degC\n}\n\nworkflow w in bench {\n    repeat 2000000 times {\n        \
        wait 1 s\n    }\n}\n";
    let mut client = Client::new(&folder("mcp_cancel"));
    let result = client.call("run", json!({ "text": endless, "seconds": 1 }));
    let said = read(&result);
    assert!(said.contains("stopped at its time limit"), "{said}");
    assert_eq!(result["structuredContent"]["report"]["status"], "cancelled");
    // More than are worked on at once: were they not stopped, the next call would find no place.
    for _ in 0..6 {
        let id = client.begin("tools/call", json!({ "name": "run", "arguments": { "text": endless, "seconds": 600 } }));
        client.send(&json!({ "jsonrpc": "2.0", "method": "notifications/cancelled", "params": { "requestId": id } }));
    }
    assert!(client.ask("ping", json!({}))["error"].is_null());
    assert_eq!(client.data("check", json!({ "text": WARM }))["errors"], 0);
    assert_eq!(client.close(), Some(0));
}

#[test]
fn lines_without_end_and_nesting_without_bottom_are_passed_over() {
    let mut client = Client::new(&folder("mcp_endless"));
    let nested = format!("{}1{}", "{\"a\":".repeat(100_000), "}".repeat(100_000));
    client.line(&"x".repeat(20 << 20));
    client.line(&format!("{{\"jsonrpc\":\"2.0\",\"id\":7,\"method\":\"tools/call\",\"params\":{nested}}}"));
    client.line(&"[".repeat(1 << 20));
    assert_eq!(client.data("check", json!({ "text": WARM }))["errors"], 0);
    assert_eq!(client.close(), Some(0));
}

#[test]
fn more_calls_than_can_wait_are_refused_and_others_answered() {
    let endless = "mtx 1\nlab bench {\n    ambient: 22 degC\n}\n\nworkflow w in bench {\n    repeat 2000000 times {\n        \
        wait 1 s\n    }\n}\n";
    let mut client = Client::new(&folder("mcp_flood"));
    let call = |text: &str| json!({ "name": "run", "arguments": { "text": text, "seconds": 600 } });
    let ids: Vec<u64> = (0..64).map(|_| client.begin("tools/call", call(endless))).collect();
    assert!(client.refused("check", json!({ "text": WARM })).contains("64 calls"));
    assert!(client.ask("ping", json!({}))["error"].is_null());
    for id in ids {
        client.send(&json!({ "jsonrpc": "2.0", "method": "notifications/cancelled", "params": { "requestId": id } }));
    }
    assert!(client.ask("ping", json!({}))["error"].is_null());
    assert_eq!(client.data("check", json!({ "text": WARM }))["errors"], 0);
    assert_eq!(client.close(), Some(0));
}

#[test]
fn a_client_that_goes_away_ends_the_server() {
    assert_eq!(Client::new(root()).close(), Some(0));
    assert_eq!(Client::silent(root()).close(), Some(0));
    let ended = matterixc_in(root(), &["mcp", "--root", "no/such/folder"]);
    assert_eq!(
        (ended.code, ended.err.as_str()),
        (2, "error: cannot serve `no/such/folder`: the file does not exist\n")
    );
}
