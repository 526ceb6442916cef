//! What the documents tell people to type exists.

use crate::command::{run, text};
use std::path::Path;

/// Lines of code in a document that call the program, without their comments; one that ends in a
/// backslash goes on.
fn commands(text: &str) -> Vec<String> {
    let joined = text.replace("\\\n", " ");
    let lines = joined.lines().filter(|line| line.starts_with("    "));
    let calls = lines.flat_map(|line| line.split("&&")).map(|call| {
        let call = call.trim();
        call.split(" #").next().unwrap_or(call).trim().to_owned()
    });
    calls.filter(|call| call.starts_with("phalanx ")).collect()
}

/// A flag that does not exist, or a value out of its range, is refused before help is printed.
#[test]
fn commands_in_documents_can_be_typed() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut documents = vec![root.join("README.md"), root.join("PERF.md")];
    for entry in std::fs::read_dir(root.join("docs")).unwrap() {
        documents.push(entry.unwrap().path());
    }
    documents.retain(|path| path.extension().is_some_and(|e| e == "md"));
    let mut count = 0;
    for document in documents {
        let content = std::fs::read_to_string(&document).unwrap();
        for call in commands(&content) {
            let arguments = call.trim_start_matches("phalanx ");
            let output = run(root, &format!("{arguments} --help"));
            let said = text(&output.stderr);
            assert!(
                output.status.success(),
                "{}: {call}\n{said}",
                document.display()
            );
            count += 1;
        }
    }
    assert!(count > 25, "{count}");
}
