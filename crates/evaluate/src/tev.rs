//! Images in the viewer tev, over its network protocol.

use crate::EvaluateError;
use lightshed_film::RgbImage;
use std::collections::HashSet;
use std::io::Write;
use std::net::TcpStream;

/// Packet that makes an image: flag, name, width, height, channel names.
const CREATE_IMAGE: u8 = 4;
/// Packet that sets pixels: flag, name, channel names, rectangle, offset and stride of each channel
/// in the values that follow, values.
const UPDATE_IMAGE: u8 = 6;

/// A connection to a running tev viewer (<https://github.com/Tom94/tev>), which shows linear images
/// with an exposure that its user sets.
///
/// A packet is its length in bytes (itself included) as a `u32`, a byte that says what it is, and
/// its fields. Numbers are little-endian, texts end with a zero byte, flags are one byte.
#[derive(Debug)]
pub struct TevViewer {
    stream: TcpStream,
    address: String,
    known: HashSet<String>,
}

impl TevViewer {
    /// The address at which tev listens unless told otherwise.
    pub const DEFAULT_ADDRESS: &str = "127.0.0.1:14158";

    /// Connects to the viewer at `address`, as `host:port`.
    ///
    /// # Errors
    /// [`EvaluateError::Viewer`] if nothing listens there.
    pub fn connect(address: &str) -> Result<Self, EvaluateError> {
        let stream = TcpStream::connect(address).map_err(|error| failed(address, &error))?;
        Ok(Self {
            stream,
            address: address.to_owned(),
            known: HashSet::new(),
        })
    }

    /// Shows `image` under `name`, in place of an earlier one of that name.
    ///
    /// # Errors
    /// [`EvaluateError::Viewer`] if the viewer has gone, or `name` has a zero byte.
    pub fn show(&mut self, name: &str, image: &RgbImage) -> Result<(), EvaluateError> {
        if name.contains('\0') {
            return Err(failed(&self.address, &"a name with a zero byte"));
        }
        let mut packets = Vec::new();
        if !self.known.contains(name) {
            packets.extend(create(name, image));
        }
        packets.extend(update(name, image));
        self.stream
            .write_all(&packets)
            .map_err(|error| failed(&self.address, &error))?;
        self.known.insert(name.to_owned());
        Ok(())
    }
}

fn failed(address: &str, reason: &dyn std::fmt::Display) -> EvaluateError {
    EvaluateError::Viewer(format!("{address}: {reason}"))
}

/// Names of the channels, in the order of a pixel's values.
const CHANNELS: [&str; 3] = ["R", "G", "B"];

fn create(name: &str, image: &RgbImage) -> Vec<u8> {
    let mut packet = begin(CREATE_IMAGE, name);
    packet.extend(image.width().to_le_bytes());
    packet.extend(image.height().to_le_bytes());
    channels(&mut packet);
    finish(packet)
}

fn update(name: &str, image: &RgbImage) -> Vec<u8> {
    let mut packet = begin(UPDATE_IMAGE, name);
    channels(&mut packet);
    for number in [0, 0, image.width(), image.height()] {
        packet.extend(number.to_le_bytes());
    }
    for offset in 0..CHANNELS.len() as u64 {
        packet.extend(offset.to_le_bytes());
    }
    for _ in CHANNELS {
        packet.extend((CHANNELS.len() as u64).to_le_bytes());
    }
    packet.extend(
        image
            .pixels()
            .as_flattened()
            .iter()
            .flat_map(|value| value.to_le_bytes()),
    );
    finish(packet)
}

/// The length, still unknown, the kind, a flag that leaves the viewer's selection alone, the name.
fn begin(kind: u8, name: &str) -> Vec<u8> {
    let mut packet = vec![0, 0, 0, 0, kind, 0];
    text(&mut packet, name);
    packet
}

fn channels(packet: &mut Vec<u8>) {
    packet.extend((CHANNELS.len() as u32).to_le_bytes());
    for channel in CHANNELS {
        text(packet, channel);
    }
}

fn text(packet: &mut Vec<u8>, text: &str) {
    packet.extend(text.as_bytes());
    packet.push(0);
}

fn finish(mut packet: Vec<u8>) -> Vec<u8> {
    // Images have at most 2²⁷ pixels: more than 4 GiB cannot be told, and the viewer refuses it.
    let length = u32::try_from(packet.len()).unwrap_or(u32::MAX);
    packet[..4].copy_from_slice(&length.to_le_bytes());
    packet
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read;
    use std::net::TcpListener;
    use std::thread;

    /// A viewer of the tests: reads packets field by field and keeps what it is told.
    struct Fields(Vec<u8>);

    impl Fields {
        fn take(&mut self, count: usize) -> Vec<u8> {
            self.0.drain(..count).collect()
        }
        fn u32(&mut self) -> u32 {
            u32::from_le_bytes(self.take(4).try_into().unwrap())
        }
        fn u64(&mut self) -> u64 {
            u64::from_le_bytes(self.take(8).try_into().unwrap())
        }
        fn text(&mut self) -> String {
            let end = self.0.iter().position(|&byte| byte == 0).unwrap();
            let text = self.take(end);
            self.take(1);
            String::from_utf8(text).unwrap()
        }
        fn texts(&mut self) -> Vec<String> {
            let count = self.u32();
            (0..count).map(|_| self.text()).collect()
        }
    }

    /// An image as the viewer holds it: size, channels, and the values of each channel.
    #[derive(Debug, PartialEq)]
    struct Shown {
        name: String,
        size: [u32; 2],
        planes: Vec<(String, Vec<f32>)>,
    }

    /// Reads all packets up to the end of the connection.
    fn view(mut bytes: Fields) -> Vec<Shown> {
        let mut shown: Vec<Shown> = Vec::new();
        while !bytes.0.is_empty() {
            let length = bytes.u32() as usize;
            let mut packet = Fields(bytes.take(length - 4));
            let kind = packet.take(1)[0];
            assert_eq!(packet.take(1)[0], 0, "the selection stays");
            let name = packet.text();
            match kind {
                4 => {
                    let size = [packet.u32(), packet.u32()];
                    let count = (size[0] * size[1]) as usize;
                    let planes = packet
                        .texts()
                        .into_iter()
                        .map(|c| (c, vec![0.0; count]))
                        .collect();
                    assert!(shown.iter().all(|other| other.name != name), "made once");
                    shown.push(Shown { name, size, planes });
                }
                6 => {
                    let image = shown
                        .iter_mut()
                        .find(|image| image.name == name)
                        .expect("it was made");
                    let channels = packet.texts();
                    let [x, y, width, height] = [0; 4].map(|_: u32| packet.u32());
                    let offsets: Vec<u64> = channels.iter().map(|_| packet.u64()).collect();
                    let strides: Vec<u64> = channels.iter().map(|_| packet.u64()).collect();
                    let values: Vec<f32> = packet
                        .take(packet.0.len())
                        .chunks_exact(4)
                        .map(|bytes| f32::from_le_bytes(bytes.try_into().unwrap()))
                        .collect();
                    for ((channel, offset), stride) in channels.iter().zip(offsets).zip(strides) {
                        let plane = image.planes.iter_mut().find(|(name, _)| name == channel).unwrap();
                        for place in 0..width * height {
                            let to = (y + place / width) * image.size[0] + x + place % width;
                            plane.1[to as usize] = values[(offset + u64::from(place) * stride) as usize];
                        }
                    }
                }
                _ => panic!("packet {kind}"),
            }
            assert!(packet.0.is_empty(), "the length fits");
        }
        shown
    }

    #[test]
    fn a_viewer_gets_the_images_and_their_updates() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap().to_string();
        let viewer = thread::spawn(move || {
            let mut bytes = Vec::new();
            listener.accept().unwrap().0.read_to_end(&mut bytes).unwrap();
            view(Fields(bytes))
        });
        let image = |scale: f32| {
            let pixels = (0..6)
                .map(|i| [scale * i as f32, 10.0 + i as f32, -1.0])
                .collect();
            RgbImage::new(3, 2, pixels).unwrap()
        };
        let mut tev = TevViewer::connect(&address).unwrap();
        tev.show("path", &image(1.0)).unwrap();
        tev.show("other", &image(3.0)).unwrap();
        tev.show("path", &image(2.0)).unwrap();
        assert!(tev.show("a\0b", &image(1.0)).is_err());
        drop(tev);
        let expected = |name: &str, scale: f32| Shown {
            name: name.to_owned(),
            size: [3, 2],
            planes: vec![
                ("R".into(), (0..6).map(|i| scale * i as f32).collect()),
                ("G".into(), (0..6).map(|i| 10.0 + i as f32).collect()),
                ("B".into(), vec![-1.0; 6]),
            ],
        };
        assert_eq!(
            viewer.join().unwrap(),
            [expected("path", 2.0), expected("other", 3.0)]
        );
    }

    #[test]
    fn a_missing_viewer_is_an_error_that_names_its_address() {
        let address = {
            let listener = TcpListener::bind("127.0.0.1:0").unwrap();
            listener.local_addr().unwrap().to_string()
        };
        let error = TevViewer::connect(&address).unwrap_err().to_string();
        assert!(error.contains(&address), "{error}");
    }
}
