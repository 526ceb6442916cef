//! The picture shown elsewhere while it is rendered.

mod tev;
mod web;

use super::Folder;

#[test]
fn previews_have_a_place() {
    let folder = Folder::new();
    for bad in ["tv", "tev=desk", "web=0.0.0.0", "web=99999"] {
        let message = folder.run(&format!("render --preview {bad}")).fails(2);
        assert!(message.contains("--preview"), "{message}");
    }
    let message = folder
        .run("render --preview web --checkpoint kept --shard 1/2")
        .fails(2);
    assert!(message.contains("--preview"), "{message}");
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let port = taken.local_addr().unwrap().port();
    let message = folder.run(&format!("render --preview web={port}")).fails(1);
    assert!(message.contains(&format!("127.0.0.1:{port}")), "{message}");
    assert!(folder.files().is_empty());
}
