//! Messages of tev's protocol, as its README describes it: a length in bytes, an operation, and
//! what that needs; all numbers little endian, texts with a zero at their end.
//!
//! <https://github.com/Tom94/tev#over-the-network>

use crate::formats::Picture;

const CREATE_IMAGE: u8 = 4;
/// With the place of each channel in the data.
const UPDATE_IMAGE: u8 = 6;

/// Channels of a picture, and of its errors.
const CHANNELS: [&str; 6] = ["R", "G", "B", "error.R", "error.G", "error.B"];

/// Numbers in a message, at most, if that is a row.
const NUMBERS: usize = 1 << 18;

struct Packet(Vec<u8>);

impl Packet {
    fn new(operation: u8) -> Self {
        let mut bytes = vec![0; size_of::<u32>()];
        bytes.push(operation);
        Self(bytes)
    }

    fn flag(&mut self, flag: bool) {
        self.0.push(u8::from(flag));
    }

    fn text(&mut self, text: &str) {
        self.0.extend(text.bytes().filter(|b| *b != 0));
        self.0.push(0);
    }

    fn int(&mut self, value: u32) {
        let value = i32::try_from(value).unwrap_or(i32::MAX);
        self.0.extend(value.to_le_bytes());
    }

    fn long(&mut self, value: usize) {
        let value = i64::try_from(value).unwrap_or(i64::MAX);
        self.0.extend(value.to_le_bytes());
    }

    fn numbers(&mut self, values: &[[f32; 3]]) {
        let values = values.as_flattened().iter();
        self.0.extend(values.flat_map(|v| v.to_le_bytes()));
    }

    fn names(&mut self, channels: &[&str]) {
        self.int(channels.len() as u32);
        channels.iter().for_each(|name| self.text(name));
    }

    fn finish(mut self) -> Vec<u8> {
        let length = u32::try_from(self.0.len()).unwrap_or(u32::MAX);
        self.0[..size_of::<u32>()].copy_from_slice(&length.to_le_bytes());
        self.0
    }
}

/// Makes an image of this name, black, in place of one that there is; tev turns to it.
pub fn create(name: &str, [width, height]: [u32; 2], errors: bool) -> Vec<u8> {
    let mut packet = Packet::new(CREATE_IMAGE);
    packet.flag(true);
    packet.text(name);
    packet.int(width);
    packet.int(height);
    packet.names(&CHANNELS[..if errors { 6 } else { 3 }]);
    packet.finish()
}

/// Fills the image: some rows a message.
pub fn update<'a>(
    name: &'a str,
    picture: &'a Picture,
    errors: Option<&'a [[f32; 3]]>,
) -> impl Iterator<Item = Vec<u8>> {
    let channels = &CHANNELS[..if errors.is_some() { 6 } else { 3 }];
    let width = picture.width as usize;
    let rows = (NUMBERS / (channels.len() * width).max(1)).max(1);
    let height = picture.height as usize;
    (0..height).step_by(rows).map(move |row| {
        let end = height.min(row + rows);
        let pixels = row * width..end * width;
        let count = pixels.len();
        let mut packet = Packet::new(UPDATE_IMAGE);
        packet.flag(false);
        packet.text(name);
        packet.names(channels);
        let place = [0, row, width, end - row];
        place.iter().for_each(|v| packet.int(*v as u32));
        // All of the picture, then all of the errors; channels in turn.
        (0..channels.len()).for_each(|c| packet.long(c / 3 * 3 * count + c % 3));
        channels.iter().for_each(|_| packet.long(3));
        packet.numbers(&picture.pixels[pixels.clone()]);
        if let Some(errors) = errors {
            packet.numbers(&errors[pixels]);
        }
        packet.finish()
    })
}
