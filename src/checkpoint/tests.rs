use super::blocks::BLOCK;
use super::file::read_from;
use super::*;
use std::fs;

fn numbers(count: usize) -> Vec<u64> {
    (0..count as u64)
        .map(|i| i.wrapping_mul(0x9e37_79b9_7f4a_7c15))
        .collect()
}

fn some() -> Packed {
    let mut to = Writer::new();
    to.value(7u32);
    to.flag(true);
    to.text("three");
    to.table(&numbers(3 * BLOCK / 8 + 5));
    to.table(&[[1.0f32, 2.0, 3.0]; 1000]);
    to.option(Some(4.5f64), |to, v| to.value(v));
    to.option(None::<f64>, |to, v| to.value(v));
    to.finish()
}

#[test]
fn values_come_back_in_order() {
    let packed = some();
    let mut from = Reader::new(&packed);
    assert_eq!(from.value(), Ok(7u32));
    assert_eq!(from.flag(), Ok(true));
    assert_eq!(from.text().unwrap(), "three");
    let count = 3 * BLOCK / 8 + 5;
    assert!(from.vector::<u64>(count).unwrap() == numbers(count));
    assert!(from.end().is_err());
    let mut room = [[0.0f32; 3]; 1000];
    from.table(&mut room).unwrap();
    assert_eq!(room, [[1.0, 2.0, 3.0]; 1000]);
    assert_eq!(from.option(Reader::value), Ok(Some(4.5f64)));
    assert_eq!(from.option(Reader::value::<f64>), Ok(None));
    assert_eq!(from.end(), Ok(()));
    assert!(from.value::<u8>().is_err());
}

#[test]
fn what_is_not_expected_is_refused() {
    let mut to = Writer::new();
    to.table(&[1u32, 2, 3]);
    to.value(2u8);
    to.count(usize::MAX);
    let packed = to.finish();
    assert!(Reader::new(&packed).vector::<u32>(2).is_err());
    assert!(Reader::new(&packed).list::<u32>(2).is_err());
    let mut from = Reader::new(&packed);
    assert_eq!(from.list::<u32>(9).unwrap(), [1, 2, 3]);
    assert!(from.flag().is_err());
    // Nothing of that size is allocated.
    assert!(from.list::<[u64; 8]>(1 << 20).is_err());
}

#[test]
fn files_are_read_as_written_or_not_at_all() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.phx");
    let head = {
        let mut to = Writer::new();
        to.text("head");
        to.finish()
    };
    let state = {
        let mut to = Writer::new();
        to.table(&numbers(40));
        to.finish()
    };
    write(&path, &head, &state).unwrap();
    assert_eq!(read(&path, true).unwrap(), (head.clone(), state));
    assert_eq!(read(&path, false).unwrap(), (head, Packed::default()));
    let content = fs::read(&path).unwrap();
    let refused = |content: &[u8]| read_from(&mut &content[..], false).is_err();
    for at in 0..content.len() {
        assert!(refused(&content[..at]), "cut at {at}");
        for bit in 0..8 {
            let mut flipped = content.clone();
            flipped[at] ^= 1 << bit;
            assert!(refused(&flipped), "bit {bit} of {at}");
        }
    }
    let longer = [&content[..], &[0]].concat();
    assert!(refused(&longer));
    assert!(matches!(
        read(folder.path(), true),
        Err(CheckpointError::Foreign | CheckpointError::Io(_))
    ));
}

#[test]
fn changed_files_are_noticed() {
    let folder = tempfile::tempdir().unwrap();
    let names = ["a.pbrt", "b.ply"].map(|name| folder.path().join(name));
    names.iter().for_each(|name| fs::write(name, "x").unwrap());
    let origin = Origin::new(Some(&names[0]), "a.pbrt", &names).unwrap();
    let mut to = Writer::new();
    origin.save(&mut to);
    let packed = to.finish();
    assert_eq!(Origin::load(&mut Reader::new(&packed)).unwrap(), origin);
    origin.check().unwrap();
    origin.check_files(&names).unwrap();
    assert!(matches!(
        origin.check_files(&names[..1]),
        Err(Change::Other(_))
    ));
    fs::write(&names[1], "y").unwrap();
    assert!(matches!(origin.check(), Err(Change::Content(path)) if path == names[1]));
    fs::remove_file(&names[1]).unwrap();
    assert!(matches!(origin.check(), Err(Change::Gone { .. })));
}
